"""Physics beyond the paper (section ``[physics]`` of a probe file)."""

from __future__ import annotations

from collections.abc import Iterable

from pydantic import Field

from hotlever.errors import unknown_name
from hotlever.records import Record


class Physics(Record):
    """Effects that the paper leaves out; off unless they are asked for.

    Examples
    --------
    >>> Physics(thermoelectric=True).effects
    ('thermoelectric',)
    """

    thermoelectric: bool = Field(
        default=False, description="heat that the current carries: Seebeck, Peltier and Thomson"
    )
    radiation: bool = Field(default=False, description="heat that the lever's surface radiates")

    @classmethod
    def of(cls, effects: Iterable[str], where: str) -> Physics:
        """Return the physics with some effects on; no more are.

        Raises
        ------
        InputError
            If there is no such effect; the nearest name is given.
        """
        effects = tuple(effects)
        for name in effects:
            if name not in cls.model_fields:
                raise unknown_name("effect", name, cls.model_fields, where)
        return cls(**dict.fromkeys(effects, True))

    @property
    def effects(self) -> tuple[str, ...]:
        """Those that are on."""
        return tuple(name for name, on in self if on)

    def __bool__(self) -> bool:
        return bool(self.effects)


#: The physics of the paper.
THE_PAPERS = Physics()
