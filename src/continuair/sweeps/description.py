"""The schema of a store's attributes, which is checked once, when the store is opened.

Checksums detect damage, not intent: who writes attributes can write their checksums too.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    StrictBool,
    StrictFloat,
    StrictInt,
    StrictStr,
    ValidationError,
    model_validator,
)

from continuair.errors import shortened, shown
from continuair.sweeps.checksums import LARGEST_FILE
from continuair.sweeps.contained import read_within
from continuair.sweeps.design import RESERVED, Design, Variable
from continuair.sweeps.tables import Base
from continuair.sweeps.units import MEANINGS
from continuair.vehicle.fields import is_title
from continuair.vehicle.vehicle import Vehicle

VERSIONS = ("continuair", "warp-lang", "numpy", "scipy")
"""Packages on whose versions results depend."""

LARGEST_DESCRIPTION = 1 << 26
"""Largest file of a store's metadata [bytes]."""

_MOST_RUNS = 1 << 40
_LONGEST_NAME = 60
_DTYPES = {"float64": "<f8", "bool": "|b1"}


def _field(value: str) -> str:
    if not value.isprintable() or "/" in value or "." not in value.strip("."):
        raise ValueError("must be the name of a field")
    return value


def _dimension(value: str) -> str:
    if not is_title(value) or value in RESERVED:
        raise ValueError("must be the name of a dimension")
    return value


_Field = Annotated[StrictStr, AfterValidator(_field)]
_Dimension = Annotated[StrictStr, AfterValidator(_dimension)]
_Count = Annotated[StrictInt, Field(gt=0, le=_MOST_RUNS)]
_Label = StrictStr | StrictBool | StrictInt | StrictFloat


class _Described(BaseModel):
    base: dict[StrictStr, Any]
    vehicle: dict[StrictStr, Any]


class Description(BaseModel):
    """The attributes of a store; further attributes of other versions are ignored."""

    model_config = ConfigDict(frozen=True, extra="allow")

    continuair_sweep: StrictInt
    checksum: StrictStr
    design: _Described
    design_hash: StrictStr
    device: Literal["cpu", "cuda"]
    files: dict[StrictStr, StrictStr]
    labels: dict[_Dimension, list[_Label]] = {}  # older stores have none
    listed: dict[_Field, tuple[list[_Dimension], Any]]
    machine: StrictStr
    models: list[StrictStr] = Field(min_length=1)
    quantities: list[StrictStr] = Field(min_length=1)
    seed: StrictInt
    sizes: dict[_Dimension, _Count]
    unit_size: _Count
    variables: list[_Field]
    versions: dict[StrictStr, StrictStr]

    @model_validator(mode="after")
    def _agree(self) -> Description:
        runs = math.prod(self.sizes.values())
        if runs > _MOST_RUNS or self.unit_size > runs:
            raise ValueError(f"sizes and unit_size are of {runs:.3g} and {self.unit_size:.3g} runs")
        for name in ("variables", "models", "quantities"):
            given = getattr(self, name)
            if len(set(given)) != len(given):
                raise ValueError(f"{name} holds one name twice")
        if not {"status", "end_time"} <= set(self.quantities) <= set(MEANINGS):
            raise ValueError(f"quantities is {shown(self.quantities)}")
        if missing := set(VERSIONS) - set(self.versions):
            raise ValueError(f"versions lacks {min(missing)}")
        return self


def problem_of(attributes: dict[str, Any]) -> str | None:
    """Return a clause on the first invalid attribute of a store, or None."""
    try:
        Description(**attributes)
    except ValidationError as error:
        first = error.errors()[0]
        where = shortened(".".join(map(str, first["loc"][:2])), _LONGEST_NAME)
        cause = first.get("ctx", {}).get("error")
        if not first["loc"]:
            return str(cause)
        if first["type"] == "missing":
            return f"{where} is missing"
        return f"{where} is {shown(first['input'])}"
    except (TypeError, RecursionError) as error:
        return shown(str(error))
    return None


def design_of(path: Path, attributes: dict[str, Any]) -> Design:
    """Return the design of the store at a path.

    Raises InputError as its tables do, and ValueError if it is not a design.
    """
    sizes: dict[str, int] = attributes["sizes"]
    variables = {}
    for name in attributes["variables"]:
        listed = attributes["listed"].get(name)
        found = _stored(path, name) if listed is None else _listed(name, *listed)
        expected = tuple(sizes.get(dim) for dim in found.dims)
        if found.values.shape != expected or len(set(found.dims)) != len(found.dims):
            raise ValueError(f"{name} has the shape {found.values.shape}, and not {expected}")
        variables[name] = found
    labels = {name: np.array(each) for name, each in attributes.get("labels", {}).items()}
    if any(each.shape != (sizes.get(name),) for name, each in labels.items()):
        raise ValueError("labels are of other sizes than dimensions")
    carried = set(labels).union(*(variable.dims for variable in variables.values()))
    if carried != set(sizes):
        raise ValueError("sizes are of dimensions that nothing varies along")
    described = attributes["design"]
    # A store of format 2 has no method: RK4.
    before = {"method": "RK4"} if attributes["continuair_sweep"] == 2 else {}
    base, vehicle = Base(**before | described["base"]), Vehicle(**described["vehicle"])
    made = Design(base, vehicle, variables, sizes, labels)
    if list(made.models) != attributes["models"]:
        raise ValueError(f"models is {shown(attributes['models'])}")
    return made


def _listed(name: str, dims: list[str], values: Any) -> Variable:
    """Return a variable whose values are in the attributes."""
    found = np.array(values)
    if found.dtype.kind not in "Ubfiu":
        raise ValueError(f"{name} is {shown(values)}")
    return Variable(tuple(dims), found)


def _stored(path: Path, name: str) -> Variable:
    """Return a variable whose values are a zarr array of one chunk without compression.

    Read without zarr, which would follow the array's metadata to other files.
    """
    metadata = read_within(path, f"design/{name}/zarr.json", LARGEST_DESCRIPTION)
    array = json.loads(metadata or b"null")
    if not isinstance(array, dict):
        raise ValueError(f"{name} is missing")
    shape: Any = array.get("shape")
    dims: Any = array.get("dimension_names")
    kind = array.get("data_type")
    whole = isinstance(shape, list) and all(type(size) is int and size > 0 for size in shape)
    named = isinstance(dims, list) and all(isinstance(dim, str) for dim in dims)
    if not whole or not named or not isinstance(kind, str) or kind not in _DTYPES:
        raise ValueError(f"{name} has the shape {shown(shape)} and the type {shown(kind)}")
    chunk = "/".join(["design", name, "c", *["0"] * len(shape)])
    content = read_within(path, chunk, LARGEST_FILE) or b""
    values = np.frombuffer(content, _DTYPES[kind])
    if math.prod(shape) != values.size:
        raise ValueError(f"{name} has the shape {shown(shape)}, but {values.size} values")
    return Variable(tuple(dims), values.reshape(shape).copy())
