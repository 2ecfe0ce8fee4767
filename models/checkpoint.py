"""An interrupted training goes on where it was: state beside the TOML file, bound to its content."""

import hashlib
from pathlib import Path
from typing import Any

import torch

EVERY = 200  # steps between two saves


class Checkpoint:
    """NAME.partial.pt; a file left by other settings is ignored."""

    def __init__(self, spec_path: Path) -> None:
        self._path = spec_path.with_suffix(".partial.pt")
        self._digest = hashlib.sha256(spec_path.read_bytes()).hexdigest()

    def load(self) -> dict[str, Any] | None:
        """The last state saved under the same settings."""
        if not self._path.exists():
            return None
        try:
            state: dict[str, Any] = torch.load(self._path, weights_only=True)
        except Exception:  # a half-written file: torch raises many kinds
            return None
        return state if state.get("digest") == self._digest else None

    def save(self, step: int, **state: Any) -> None:
        """Keep the state after `step` steps; a kill while writing leaves the last one whole."""
        fresh = self._path.with_suffix(".new")
        torch.save({"digest": self._digest, "step": step, **state}, fresh)
        fresh.replace(self._path)

    def clear(self) -> None:
        """Training is over."""
        self._path.unlink(missing_ok=True)
