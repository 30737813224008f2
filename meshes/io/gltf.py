"""Sheets as binary glTF 2.0 (.glb), by trimesh, for browsers and phones. Metres and y up, as glTF asks."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from meshes.errors import FileFormatError
from meshes.io.export import replacing, shown, texture
from meshes.mesh import SheetMesh

TEXTURE = "_texture"  # what trimesh calls the attribute that becomes TEXCOORD_0
METRE = 1e-3  # of a millimetre
PAPER, INK = (185, 196, 207, 255), (27, 27, 31, 255)


def write_gltf(
    path: str | os.PathLike[str],
    mesh: SheetMesh,
    points: ArrayLike | None = None,
    colours: ArrayLike | None = None,
) -> None:
    """Write the triangles, seen from both sides, with creases and boundary as dark lines.

    Where the mesh is flat, its sheet is the texture coordinates: the longer side from 0 to 1, upright.

    Args:
        path: of the .glb file.
        mesh: the triangles, and the positions where `points` is None.
        points: (n, 3) positions of a folded state, mm; the mesh's own where None.
        colours: (n, 3) or (n, 4) of the nodes as a screen shows them (sRGB), 0 to 255.

    Raises:
        FileFormatError: another suffix than .glb, arrays that do not fit, a place that cannot be written to.
    """
    import trimesh

    name = shown(path)
    if not os.fspath(path).lower().endswith(".glb"):
        raise FileFormatError(f"{name}: glTF is written as one binary file; name it .glb")
    place = np.asarray(mesh.points if points is None else points, dtype=float)
    if place.shape != mesh.points.shape or not np.isfinite(place).all():
        raise FileFormatError(f"{name}: points must be {len(mesh.points)} rows of three finite numbers in mm")
    shades = np.tile(np.array(PAPER, dtype=np.uint8), (len(place), 1))
    if colours is not None:
        given = np.asarray(colours)
        if given.shape not in ((len(place), 3), (len(place), 4)):
            raise FileFormatError(
                f"{name}: colours have shape {given.shape}; give ({len(place)}, 3) of 0 to 255"
            )
        shades[:, : given.shape[1]] = given
    shades[:, :3] = _linear(shades[:, :3])
    x, y, z = (METRE * place).T
    upright = np.column_stack((x, z, -y))
    sheet = trimesh.Trimesh(upright, mesh.triangles, vertex_colors=shades, process=False)
    if (flat := texture(mesh)) is not None:  # glTF counts v downwards
        sheet.vertex_attributes[TEXTURE] = np.column_stack((flat[:, 0], 1.0 - flat[:, 1])).astype(np.float32)
    pairs = [mesh.topology.boundary, *(mesh.crease_edges(crease) for crease in mesh.creases)]
    lines = trimesh.load_path(upright[np.unique(np.sort(np.vstack(pairs), axis=1), axis=0)])
    lines.colors = np.tile(np.array(INK, dtype=np.uint8), (len(lines.entities), 1))
    scene = trimesh.Scene({"sheet": sheet, "lines": lines})
    data = scene.export(file_type="glb", tree_postprocessor=_both_sides)
    with replacing(path) as temporary:
        temporary.write_bytes(data)


def _linear(shades: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Colours in linear light, which glTF keeps at nodes (IEC 61966-2-1)."""
    part = shades / 255.0
    light = np.where(part <= 0.04045, part / 12.92, ((part + 0.055) / 1.055) ** 2.4)
    return np.asarray(np.round(255.0 * light), dtype=np.uint8)


def _both_sides(tree: dict[str, Any]) -> None:
    """A sheet has no inside: its triangles are drawn from both sides. Texture coordinates get their name."""
    materials = tree.setdefault("materials", [])
    materials.append(
        {"doubleSided": True, "pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 0.9}}
    )
    for mesh in tree["meshes"]:
        for part in mesh["primitives"]:
            if part["mode"] == 4:
                part["material"] = len(materials) - 1
                if TEXTURE in part["attributes"]:
                    part["attributes"]["TEXCOORD_0"] = part["attributes"].pop(TEXTURE)
