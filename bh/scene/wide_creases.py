"""Wide creases of a scene: `[creases.NAME]` with a width, or `[creases.all]` for all that have no own table."""

from __future__ import annotations

from pydantic import Field

from bh.errors import SceneError
from bh.model.sheet import Sheet
from bh.model.wide_crease import strip, told_twice
from bh.model.zones import SheetZone
from bh.scene.reading import LSTAR, Scale, Stiff, as_table, nearest, read_table, within
from bh.scene.sheets import OtherSheetTable, zone_of
from meshes import CreasePattern, SheetMesh
from meshes.wide import STRIP, wide_creases

EVERY = "all"
OWN = ("width", "Lstar", "stiffness")


class WideCreaseTable(OtherSheetTable):
    """A crease that is a strip of some width; what is left out of its material is that of the sheet."""

    width: Scale = Field(description="the width of the strip in mm, a positive number")
    Lstar: Scale | None = Field(None, description=LSTAR)
    stiffness: Stiff | None = Field(None, description="a positive stiffness a length, N mm / (mm rad)")


def wide_tables(creases: dict[str, object]) -> dict[str, dict[str, object]]:
    """Tables of creases that have a width.

    Args:
        creases: all tables of creases.

    Returns:
        the tables by the name of the crease.
    """
    return {name: item for name, item in creases.items() if isinstance(item, dict) and "width" in item}


def widened(pattern: CreasePattern, creases: dict[str, object]) -> CreasePattern:
    """The pattern with its wide creases.

    Args:
        pattern: as it is drawn.
        creases: all tables of creases; one without a width stays a line, whatever the table for all says.

    Raises:
        SceneError: a crease that cannot be wide; one line.
    """
    widths = {}
    for name, item in wide_tables(creases).items():
        table = read_table(WideCreaseTable, item, f"creases.{name}")
        if name != EVERY:
            widths[name] = table.width
            continue
        others = [c.name for c in pattern.creases if c.fold != "flat" and c.name not in creases]
        widths |= dict.fromkeys(others, table.width)
    for name, width in widths.items():
        known = [crease.name for crease in pattern.creases]
        if name not in known:
            raise SceneError(
                f"creases.{name}: the pattern has no single crease '{name}'{nearest(name, known)}; its creases: "
                f"{', '.join(known) or 'none'}"
            )
        with within(f"creases.{name if name in creases else EVERY}.width"):
            pattern = wide_creases(pattern, {name: width})
    return pattern


def strips_of(
    mesh: SheetMesh, creases: dict[str, dict[str, object]], sheet: Sheet, zones: tuple[SheetZone, ...]
) -> tuple[SheetZone, ...]:
    """Zones of the strips.

    Args:
        mesh: of the widened pattern.
        creases: tables of the wide ones.
        sheet: of the scene.
        zones: of the scene.

    Returns:
        one a strip.

    Raises:
        SceneError: keys that do not go together; one line.
    """
    found = []
    for name in mesh.wide_creases:
        own = name if name in creases else EVERY
        at = f"creases.{own}"
        item = as_table(creases[own], at)
        table = read_table(WideCreaseTable, item, at)
        if table.Lstar is not None or table.stiffness is not None or not set(item) - set(OWN):
            other = next((key for key in item if key not in OWN), None)
            if other is not None:
                one = "Lstar" if table.Lstar is not None else "stiffness"
                raise SceneError(told_twice(at, one, other))
            with within(at):
                found.append(strip(mesh, name, sheet, table.Lstar, table.stiffness, zones=zones))
            continue
        material = {key: value for key, value in item.items() if key not in OWN}
        found.append(zone_of({**material, "where": STRIP + name}, sheet, at))
    return tuple(found)
