"""The last word on every velocity: a guard that trusts nobody and always holds a verified way out.

It uses the vehicle's own state, the autopilot's heartbeat and the exact reachable sets, nothing of
the field or the network.  `docs/guard.md` has the claim, its assumptions and the argument.

    preconditions  ->  wanted velocity, limited  ->  a way out after it?  ->  pass, or fly the stored one
"""

from companion.planning.guard.intended import Intended
from companion.planning.guard.judge import Guard
from companion.planning.guard.verdict import Velocity, Verdict

__all__ = ["Guard", "Intended", "Velocity", "Verdict"]
