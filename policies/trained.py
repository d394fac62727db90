"""The policy of a trained network: where to go, from the situation, by weights that reinforcement learning found."""

from __future__ import annotations

import hashlib
import tokenize
import zipfile
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from teamsight.core import files
from teamsight.core.kernel import inlined, scratch
from teamsight.policies.actions import act_along
from teamsight.policies.compiled import CompiledPolicy
from teamsight.policies.interface import Percept
from teamsight.policies.learner import check_situations

#: A weight matrix, shape (outputs, inputs), and a bias, shape (outputs,), float32.
Layer = tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]

#: The largest number of inputs or neurons of a layer.
MOST_NEURONS = 512
#: What observations of environments say of a distance in ranges: 1 − it, 0 where nothing is sensed; or the distance.
ENCODINGS = ("nearness", "distance")
#: What a layer of a network answers to: a way ahead and a way to the left.
OUTPUTS = 2

#: The files of the networks that ship, by name.
SHIPPED = {
    name: Path(__file__).parent / "data" / f"{file}.npz"
    for name, file in (("", "ppo"), ("many-teams", "ppo-many-teams"))
}
_UNREADABLE = ValueError, KeyError, EOFError, OSError, TypeError, RuntimeError, OverflowError
_CURE = "give a file as examples/train_ppo.py writes it"


@inlined
def _decide(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    """Write the actions: each layer is a sum over its inputs that are not 0, which few inputs of the first are."""
    is_near = arrays.parameters[0] > 0.0
    sizes = arrays.parameters[1:]
    weights = arrays.table
    before = scratch(MOST_NEURONS, np.float64)
    after = scratch(MOST_NEURONS, np.float64)
    last = sizes.shape[0] - 2
    for i in range(percept.heading.shape[0]):
        for k in range(int(sizes[0])):
            value = float(percept.situation[i, k])
            before[k] = 1.0 - value if is_near else value
        row = 0
        for layer in range(last + 1):
            outputs = int(sizes[layer + 1])
            for j in range(outputs):
                after[j] = weights[row, j]
            row += 1
            for k in range(int(sizes[layer])):
                if before[k] != 0.0:
                    for j in range(outputs):
                        after[j] += weights[row, j] * before[k]
                row += 1
            for j in range(outputs):
                before[j] = after[j] if layer == last else max(after[j], 0.0)
        act_along(before[0], before[1], i, percept, action)


@dataclass(frozen=True, eq=False, repr=False)
class Trained(CompiledPolicy):
    """Go where a network of rectified linear units says, from the situation of the robot.

    Its inputs are the observations that environments have by default: 1 − the situation, 0 where nothing is sensed, and
    the more the nearer. Its two outputs are an action of the form "vector" of environments: the way ahead and to the
    left, in speeds.

    Parameters
    ----------
    file : str
        The weights: an ``.npz`` file with ``degree``, the name of the degree of awareness, and of each layer k from 0
        on ``weight_k``, shape (outputs, inputs), and ``bias_k``, shape (outputs,), as torch has them. It may have
        ``encoding``, that of the observations: "nearness", as if there is none, or "distance". By default the weights
        shipped, which ``examples/train_ppo.py`` made for `RingAwareness(16)` from 2 × 10⁶ steps of robots; "many-teams"
        are those that it made from 10⁹ steps of seven teams.

    Attributes
    ----------
    layers : tuple of (ndarray, ndarray)
        The weights and the bias of each layer, float32.
    degree : str
        The name of the degree of awareness.
    encoding : {"nearness", "distance"}
        Whether it reads 1 − the situation, or the situation.
    inputs : int
        The width of the situation.

    Raises
    ------
    OSError
        If the file cannot be read.
    ValueError
        If it holds no network, or one of other shapes.

    Notes
    -----
    *Source:* none. J. Schulman and others, "Proximal policy optimization algorithms" (2017) for the training; see
    docs/train-ppo.md. The policy keeps no memory and reads no compass. Sums are in float64, in the order of inputs.
    """

    file: str = ""

    kernel = _decide
    layers: ClassVar[tuple[Layer, ...]] = ()
    encoding: ClassVar[str] = "nearness"

    def __post_init__(self) -> None:
        super().__post_init__()
        degree, encoding, layers = _read(SHIPPED.get(self.file) or Path(self.file))
        found = {"degree": degree, "encoding": encoding, "layers": layers, "inputs": layers[0][0].shape[1]}
        for name, value in found.items():
            object.__setattr__(self, name, value)

    @property
    def reads_teammates(self) -> bool:
        return False  # It reads the situation vector.

    def check_percept(self, percept: Percept) -> None:
        check_situations(self, percept)

    @property
    def parameters(self) -> tuple[float, ...]:
        """Whether it reads nearness, the number of inputs, and of the outputs of each layer."""
        return (float(self.encoding == "nearness"), float(self.inputs), *(float(len(bias)) for _, bias in self.layers))

    @property
    def table(self) -> npt.NDArray[np.float32]:
        """For each layer a row of biases, and one of the weights of each input."""
        rows = [np.concatenate([bias[None], weight.T]) for weight, bias in self.layers]
        width = max(part.shape[1] for part in rows)
        return np.concatenate([np.pad(part, ((0, 0), (0, width - part.shape[1]))) for part in rows])

    @property
    def _digest(self) -> str:
        # Files of nearness do not say so if they are old, and are known by the same digest.
        read = str(self.degree) + ("" if self.encoding == "nearness" else self.encoding)
        return hashlib.blake2b(read.encode() + self.table.tobytes(), digest_size=4).hexdigest()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Trained) and self._digest == other._digest

    def __hash__(self) -> int:
        return hash(self._digest)

    def __repr__(self) -> str:
        if self.file in SHIPPED:
            return f"Trained({self.file!r})" if self.file else "Trained()"
        return f"Trained(<{self._digest}>)"


def _read(path: Path) -> tuple[str, str, tuple[Layer, ...]]:
    """Return the degree, the encoding and the layers of a file."""
    with files.open_regular(path) as file:
        try:
            with np.load(file, allow_pickle=False) as found:
                content = {name: found[name] for name in found.files}
                degree, encoding = str(content["degree"]), str(content.get("encoding", "nearness"))
        except (*_UNREADABLE, zipfile.BadZipFile, zlib.error, tokenize.TokenError) as error:
            raise ValueError(f"{path}: holds no trained network ({error}); {_CURE}") from error
    if encoding not in ENCODINGS:
        raise ValueError(
            f"{path}: encoding={encoding!r} is unknown; give that of the environment, {' or '.join(ENCODINGS)}"
        )
    layers: list[Layer] = []
    while f"weight_{len(layers)}" in content:
        at = len(layers)
        weight, bias = (np.asarray(content.get(f"{name}_{at}", 0.0)) for name in ("weight", "bias"))
        width = weight.shape[1] if not layers and weight.ndim == 2 else len(layers[-1][1]) if layers else 0
        is_one = weight.ndim == 2 and weight.shape == (*bias.shape, width) and weight.size
        if not is_one or max(weight.shape) > MOST_NEURONS:
            raise ValueError(
                f"{path}: layer {at} has weights of the shape {weight.shape} and a bias of {bias.shape}; they must be "
                f"(outputs, inputs) and (outputs,), at most {MOST_NEURONS} of each, and fit the layer before"
            )
        for name, one in (("weight", weight), ("bias", bias)):
            if one.dtype.kind != "f" or not (np.abs(one) <= np.finfo(np.float32).max).all():
                raise ValueError(f"{path}: {name}_{at} must hold finite numbers, and has the type {one.dtype}")
        layers.append((weight.astype(np.float32), bias.astype(np.float32)))
    if not layers or len(layers[-1][1]) != OUTPUTS:
        last = len(layers[-1][1]) if layers else 0
        raise ValueError(f"{path}: the last layer has {last} outputs; it must have {OUTPUTS}, ahead and to the left")
    known = {"degree", "encoding", *(f"{name}_{at}" for name in ("weight", "bias") for at in range(len(layers)))}
    if left := sorted(content.keys() - known):
        raise ValueError(f"{path}: {left[0]!r} is no part of its {len(layers)} layers, numbered from 0; {_CURE}")
    return degree, encoding, tuple(layers)
