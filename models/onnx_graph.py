"""A few lines to write an ONNX graph by hand: constants are deduplicated, tensors name themselves."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import onnx
from numpy.typing import ArrayLike, DTypeLike, NDArray
from onnx import TensorProto, helper, numpy_helper

OPSET = 18
IR_VERSION = 9  # readable by onnxruntime 1.17 and later


class GraphBuilder:
    """Collects nodes and initializers; tensors are passed around by name."""

    def __init__(self) -> None:
        self._nodes: list[onnx.NodeProto] = []
        self._constants: dict[str, onnx.TensorProto] = {}
        self._names: dict[bytes, str] = {}

    def constant(self, value: ArrayLike, dtype: DTypeLike = np.float64, name: str = "") -> str:
        """An initializer; a nameless one with the same value and type is shared."""
        array: NDArray[Any] = np.asarray(value, dtype=dtype)
        key = array.dtype.str.encode() + str(array.shape).encode() + array.tobytes()
        if not name and key in self._names:
            return self._names[key]
        name = name or f"c{len(self._constants)}"
        self._names.setdefault(key, name)
        self._constants[name] = numpy_helper.from_array(array, name)
        return name

    def index(self, values: ArrayLike) -> str:
        """An int64 initializer."""
        return self.constant(np.asarray(values), np.int64)

    def op(self, kind: str, *inputs: str, output: str = "", **attributes: Any) -> str:
        """Append a node with one output and return the output's name."""
        output = output or f"t{len(self._nodes)}"
        self._nodes.append(helper.make_node(kind, list(inputs), [output], **attributes))
        return output

    def split(
        self, tensor: str, sizes: Sequence[int], axis: int = 1, outputs: Sequence[str] = ()
    ) -> tuple[str, ...]:
        """Cut a tensor along an axis."""
        outputs = outputs or [f"t{len(self._nodes)}_{i}" for i in range(len(sizes))]
        self._nodes.append(helper.make_node("Split", [tensor, self.index(sizes)], outputs, axis=axis))
        return tuple(outputs)

    def ascending(self, tensor: str, count: int) -> str:
        """Each column of a tensor with `count` rows, sorted."""
        outputs = [f"t{len(self._nodes)}_values", f"t{len(self._nodes)}_places"]
        node = helper.make_node("TopK", [tensor, self.index([count])], outputs, axis=0, largest=0, sorted=1)
        self._nodes.append(node)
        return outputs[0]

    def cast32(self, tensor: str) -> str:
        """To float32."""
        return self.op("Cast", tensor, to=TensorProto.FLOAT)

    def cast64(self, tensor: str) -> str:
        """To float64."""
        return self.op("Cast", tensor, to=TensorProto.DOUBLE)

    def model(
        self,
        inputs: dict[str, Sequence[int | str]],
        outputs: dict[str, Sequence[int | str]],
        metadata: dict[str, str],
        element: int = TensorProto.DOUBLE,
    ) -> onnx.ModelProto:
        """The checked model; a string in a shape is a dynamic dimension."""
        graph = helper.make_graph(
            self._nodes,
            "companion",
            [helper.make_tensor_value_info(name, element, list(shape)) for name, shape in inputs.items()],
            [helper.make_tensor_value_info(name, element, list(shape)) for name, shape in outputs.items()],
            list(self._constants.values()),
        )
        model = helper.make_model(
            graph,
            opset_imports=[helper.make_opsetid("", OPSET)],
            ir_version=IR_VERSION,
            producer_name="companion",
        )
        for key, value in metadata.items():
            entry = model.metadata_props.add()
            entry.key, entry.value = key, value
        onnx.checker.check_model(model, full_check=True)
        return model
