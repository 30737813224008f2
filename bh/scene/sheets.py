"""Tables [sheet] and [[zones]] of a scene: what the sheet is made of, and where it is made of something else."""

from __future__ import annotations

from pydantic import Field

from bh.errors import SceneError
from bh.materials.table import material as material_of
from bh.model.laminate import laminate
from bh.model.sheet import Sheet
from bh.model.zones import SheetZone, changed
from bh.scene.reading import REGION, Positive, Region, read_table, within
from bh.scene.tables import SheetTable

OTHER_NAMES = {"E1": "E", "nu12": "nu"}
OF_A_GRAIN = ("E2", "G12", "grain", "strength2", "shear_strength")


class OtherSheetTable(SheetTable):
    """What a part of the sheet is made of; what is left out is that of the sheet."""

    stiff: Positive = Field(
        1.0, description="a factor of the moduli, a positive number; 1000 is as good as rigid"
    )

    def names(self) -> None:
        """Check that nothing is given by two names; the moduli may be left out."""
        if self.plies is not None or self.material is not None or self.E is not None or self.E1 is not None:
            super().names()


class ZoneTable(OtherSheetTable):
    """A part of the sheet that is made of something else."""

    where: Region = Field(description=REGION)


def sheet_of(data: object) -> Sheet:
    """The sheet of a scene.

    Args:
        data: its table.

    Raises:
        SceneError: keys or values that cannot be; one line.
    """
    return _read(data, "sheet")


def _read(data: object, at: str) -> Sheet:
    table = read_table(SheetTable, data, at)
    if table.plies is not None:
        return _laminate(table.plies, at)
    if table.material is not None:
        return _of_material(table, at)
    if table.t is None:
        raise SceneError(f"{at}.t is missing; give the thickness in mm, a positive number")
    with within(at):
        return changed(Sheet(E=1.0, t=1.0), **_given(table))


def _laminate(plies: list[dict[str, object]], at: str) -> Sheet:
    found = [_read(ply, f"{at}.plies[{i}]") for i, ply in enumerate(plies)]
    with within(at):
        return laminate(found)


def zones_of(data: list[object], sheet: Sheet) -> tuple[SheetZone, ...]:
    """The zones of a scene.

    Args:
        data: their tables.
        sheet: of the scene.

    Returns:
        the zones in order.

    Raises:
        SceneError: keys or values that cannot be; one line.
    """
    return tuple(zone_of(item, sheet, f"zones[{i}]") for i, item in enumerate(data))


def zone_of(item: object, sheet: Sheet, at: str) -> SheetZone:
    """One zone.

    Args:
        item: its table.
        sheet: of the scene.
        at: where the table stands, for messages.

    Raises:
        SceneError: keys or values that cannot be; one line.
    """
    table = read_table(ZoneTable, item, at)
    if table.material is not None:
        made = _of_material(table, at)
        with within(at):
            return SheetZone(table.where, changed(made, table.stiff))
    if table.plies is not None:
        made = _laminate(table.plies, at)
        with within(at):
            return SheetZone(table.where, changed(made, table.stiff))
    given: dict[str, float | None] = {**_given(table)}
    alike = (table.E is not None or "nu" in given) and not any(key in given for key in ("E2", "G12", "grain"))
    if alike and sheet.grain is not None:  # E and nu alone are a sheet that is alike in all directions
        given = dict.fromkeys(OF_A_GRAIN) | given
    with within(at):
        return SheetZone(table.where, changed(sheet, table.stiff, **given))


def _of_material(table: SheetTable, at: str) -> Sheet:
    assert table.material is not None
    with within(at):
        made = material_of(table.material).sheet(table.t, table.grain)
        more = {"density": table.density, "expansion": table.expansion}
        return Sheet(**{**vars(made), **{key: value for key, value in more.items() if value is not None}})


def _given(table: SheetTable) -> dict[str, float]:
    """What a table gives, by the names of `Sheet`."""
    given = {key: getattr(table, key) for key in SheetTable.model_fields if key not in ("material", "plies")}
    return {OTHER_NAMES.get(key, key): value for key, value in given.items() if value is not None}
