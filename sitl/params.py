"""The autopilot's parameters: a fixed, read-only handful, so that a ground station gets its list."""

from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mav


class Params:
    """Answers PARAM_REQUEST_LIST, PARAM_REQUEST_READ and PARAM_SET (with the value that stands)."""

    def __init__(self, values: dict[str, float]) -> None:
        self._values = values
        self._names = list(values)

    def list_all(self) -> list[mav.MAVLink_message]:
        """PARAM_VALUE of every parameter."""
        return [self._value(name) for name in self._names]

    def read(self, request: Any) -> list[mav.MAVLink_message]:
        """The parameter asked for by index (>= 0) or by name; nothing if there is none such."""
        index = getattr(request, "param_index", -1)
        raw = request.param_id
        name = (raw if isinstance(raw, str) else raw.decode("ascii", "replace")).rstrip("\0")
        if 0 <= index < len(self._names):
            name = self._names[index]
        return [self._value(name)] if name in self._values else []

    def _value(self, name: str) -> mav.MAVLink_message:
        return mav.MAVLink_param_value_message(
            name.encode("ascii"),
            self._values[name],
            mav.MAV_PARAM_TYPE_REAL32,
            len(self._names),
            self._names.index(name),
        )
