"""From a configuration to a core: the one place that chooses implementations."""

from dataclasses import dataclass

from companion.config import Config
from companion.core import Core
from companion.planning.field import ExactRepulsion
from companion.planning.network import NetworkRepulsion
from companion.planning.steering import RepulsionField
from companion.reach import choose_kernel
from companion.wire.mavlink import MavlinkEncoder


@dataclass(frozen=True, slots=True)
class Companion:
    """A core ready to step, its encoder, and the digests of the models inside ("" without one)."""

    core: Core
    encoder: MavlinkEncoder
    model_digest: str
    turning_digest: str


def build(config: Config) -> Companion:
    """Load the model and put the parts together; raises `ModelError` when they disagree."""
    kernel = choose_kernel(config.reach.kernel)
    repulsion: RepulsionField
    digest = turning = ""
    if config.repulsion.kind == "network":
        network = NetworkRepulsion.load(config.repulsion.model, config, kernel)
        repulsion, digest, turning = network, network.digest, network.turning_digest
    else:
        repulsion = ExactRepulsion(config.field, kernel)
    encoder = MavlinkEncoder(system_id=config.autopilot.system_id, component_id=config.autopilot.component_id)
    return Companion(Core(config, repulsion, kernel), encoder, digest, turning)
