"""The one training loop: Adam on fresh samples, saved as it goes, the same for the same seed.

Every step draws from a generator of its own, seeded by (seed, step), so that a resumed run sees the
same samples as an unbroken one.
"""

from collections.abc import Callable

import numpy as np
import torch

from models.checkpoint import EVERY, Checkpoint

Progress = Callable[[str, float, str], None]  # stage, share done, a word on how it goes
Loss = Callable[[np.random.Generator], torch.Tensor]


def descend(
    module: torch.nn.Module,
    loss_on: Loss,
    *,
    steps: int,
    rate: float,
    decay: bool,
    seed: int,
    checkpoint: Checkpoint | None,
    progress: Progress,
) -> None:
    """Minimise `loss_on(generator)` over the module's parameters."""
    optimizer = torch.optim.Adam(module.parameters(), rate)
    first = 0
    state = checkpoint.load() if checkpoint else None
    if state is not None:
        module.load_state_dict(state["module"])
        optimizer.load_state_dict(state["optimizer"])
        first = state["step"]
    for step in range(first, steps):
        if decay:  # a half cosine down to nothing
            optimizer.param_groups[0]["lr"] = rate * 0.5 * (1 + np.cos(np.pi * step / steps))
        loss = loss_on(np.random.default_rng((seed, step)))
        optimizer.zero_grad()
        torch.autograd.backward(loss)
        optimizer.step()
        done = step + 1
        if done % 20 == 0 or done == steps:
            progress("train", done / steps, f"loss {float(loss.detach()):.3g}")
        if checkpoint and (done % EVERY == 0 or done == steps):
            checkpoint.save(done, module=module.state_dict(), optimizer=optimizer.state_dict())
