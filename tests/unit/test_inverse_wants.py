"""Designs with more wants than a point, batches that are polished together, and strips that are made differently."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("xarray")
from xarray import Dataset

from bh.applications.inverse import models, surrogate
from bh.applications.inverse.along import along, along_strip, landed
from bh.applications.inverse.boxes import ROOM, depths
from bh.applications.inverse.converged import Converged
from bh.applications.inverse.descent import descend
from bh.applications.inverse.fit import folded_fit
from bh.applications.inverse.levels import lagrange
from bh.applications.inverse.models import model
from bh.applications.inverse.optimisers import Found
from bh.applications.inverse.piece_data import PieceData
from bh.applications.inverse.pieces import CONVERGING, LEVELS, PieceTask
from bh.applications.inverse.problems import Design, FitCurve
from bh.applications.inverse.reach import Library, Reach
from bh.applications.inverse.segments import DesignError
from bh.applications.inverse.simulate import simulate
from bh.applications.inverse.tolerances import Spreads, predicted, tolerance
from bh.applications.inverse.variants import STEPS, closed, parts, table
from bh.applications.inverse.wants import ReachAll, Wants

K0, LENGTH, ON = [0.006, -0.007], [131.3, 120.0], [True, True]
DESIGN = Design(np.array(K0), np.array(LENGTH), np.array(ON))


def converged() -> Converged:
    found = model()
    assert isinstance(found, Converged)
    return found


# --- batches ------------------------------------------------------------------------------------------------


class Bowl:
    """Residuals (x - 1, y (1 + on) - 3) whose second zero lies outside the box where nothing is switched on."""

    lower, upper = np.zeros(2), np.full(2, 2.0)

    def residuals(self, x: np.ndarray, on: np.ndarray) -> np.ndarray:
        return np.column_stack((x[:, 0] - 1.0, x[:, 1] * (1.0 + on[:, 0]) - 3.0))


def test_batches_go_down_inside_the_box() -> None:
    """Each with its own switches: to the zero, or to the side of the box next to it; what is outside begins there."""
    x = np.array([[0.1, 0.1], [1.9, 1.9], [-5.0, 7.0], [0.3, 1.0]])
    on = np.array([[True], [False], [True], [False]])
    np.testing.assert_allclose(
        descend(Bowl(), x, on), [[1.0, 1.5], [1.0, 2.0], [1.0, 1.5], [1.0, 2.0]], atol=1e-5
    )


def test_a_batch_finds_what_one_by_one_finds() -> None:
    """A candidate does not depend on its neighbours in the batch, and none gets worse."""
    book = Library(converged(), 2, size=4000)
    target = np.array([50.0, 150.0, 0.0])
    problem = book.problem(target)
    x, on = book.nearest(target, 6)
    together = descend(problem, x, on)
    for i in range(len(x)):
        np.testing.assert_allclose(descend(problem, x[i : i + 1], on[i : i + 1])[0], together[i], atol=1e-6)
    before, after = (np.linalg.norm(problem.residuals(each, on), axis=1) for each in (x, together))
    assert (after <= before).all()
    assert (after < 1e-3).any()


# --- strips that are made differently -----------------------------------------------------------------------


@pytest.fixture(scope="module")
def data() -> Dataset:
    return surrogate.loaded(models.beside(models.SHIPPED))


def test_points_of_the_variants(data: Dataset) -> None:
    """The shipped variants are those of this version, simulated, stable, small; one of them is simulated anew."""
    for name, column in table(CONVERGING).items():
        assert data[name].values.tolist() == column
    assert (data["outcome"].values == "reached").all()
    assert (data["stable"].values == 1.0).all()
    assert models.beside(models.SHIPPED).stat().st_size < 500_000
    row = int(np.flatnonzero((data["kind"].values == "pinch") & (data["before"].values > 0.015))[3])
    point = {name: data[name].values[row].item() for name in table(CONVERGING)}
    np.testing.assert_allclose(PieceTask()(point)["t"], data["t"].values[row], atol=1e-5)


@pytest.mark.parametrize("level", [0, pytest.param(1, marks=pytest.mark.slow)])
def test_differences_are_those_of_strips(level: int) -> None:
    """A whole strip with each thing off by a step moves as the chain of its mesh, where pinches lie on equal cells."""
    length = [130.0, 120.0]  # multiples of 5 mm: a node is in the middle of each pinch, as in the pieces
    mesh = LEVELS["pinch"][level]
    same = converged().on_mesh(level)
    moves = predicted(same, K0, length, ON, Spreads(**STEPS, k0=0.0, length=0.0)).moves
    setting = replace(converged().setting, edge=mesh.edge, rows=mesh.rows)
    for name in ("fold", "pinch", "zone", "t"):
        up, down = (
            simulate(K0, length, ON, replace(setting, **{name: getattr(setting, name) + s * STEPS[name]})).t
            for s in (1.0, -1.0)
        )
        whole = 0.5 * (up - down)
        assert np.linalg.norm(moves[name] - whole) < 0.06 * np.linalg.norm(whole) + 0.01, name


def test_differences_are_those_of_fine_meshes() -> None:
    """By 0.02 rad of the pinch strips move 1.124, 1.309, 1.406, 1.435 mm on 2, 4, 8, 16 rows: extrapolated 1.445."""
    spreads = Spreads(**STEPS, k0=0.0, length=0.0)
    moves = predicted(converged(), K0, [130.0, 120.0], ON, spreads).moves["pinch"]
    assert np.linalg.norm(moves) == pytest.approx(1.445, rel=0.01)


def test_the_cut_of_many_designs() -> None:
    """Movements of a batch are those of each design, and scale with the spread."""
    k0, length = np.array([K0, [0.002, 0.009]]), np.array([LENGTH, [200.0, 110.0]])
    both = predicted(converged(), k0, length, np.array([ON, [False, True]]))
    one = predicted(converged(), k0[1], length[1], [False, True])
    np.testing.assert_allclose(both.size[1], one.size, rtol=1e-9)
    twice = predicted(converged(), k0[1], length[1], [False, True], Spreads(fold=0.04, k0=2e-5))
    for name in ("fold", "k0 of segment 2"):
        np.testing.assert_allclose(twice.moves[name], 2.0 * one.moves[name], rtol=1e-4)
    plain = predicted(converged(), k0[1], length[1], [False, False])
    assert np.linalg.norm(plain.moves["pinch"]) < 1e-9 < np.linalg.norm(one.moves["pinch"])
    whole = tolerance(converged(), DESIGN, Spreads(Lstar=0.0, t=0.0, zone=0.0, pinch=0.0, fold=0.0))
    for name, move in whole.moves.items():
        np.testing.assert_allclose(both.moves[name][0], move, atol=1e-9)


def test_pinches_that_are_closed_by_a_part() -> None:
    """Nothing, all of it, and, at a part between those that were simulated, what a whole strip does."""
    np.testing.assert_allclose(lagrange(parts(), 0.3) @ parts() ** 4, 0.3**4, atol=1e-12)
    full, none = (converged().closed_by(part).forward(K0, LENGTH, ON)[0] for part in (1.0, 0.0))
    np.testing.assert_allclose(full, converged().forward(K0, LENGTH, ON)[0], atol=1e-9)
    np.testing.assert_allclose(none, converged().unpinched(K0, LENGTH)[0], atol=1e-9)
    found = converged().closed_by(0.7)
    landing = found.land(K0, LENGTH, ON)
    assert landing.strip.path.model.steps[1].actuations[0].to == pytest.approx(  # type: ignore[attr-defined]
        closed(converged().setting, 0.7).pinch, abs=0.02
    )
    assert np.linalg.norm(landing.end - found.forward(K0, LENGTH, ON)[0][-1]) < 0.4
    assert np.linalg.norm(landing.end - converged().forward(K0, LENGTH, ON)[0][-1]) > 5.0
    assert 0.0 < landing.bar < 1.0
    with pytest.raises(DesignError, match="part from 0 to 1"):
        converged().closed_by(1.2)
    with pytest.raises(DesignError, match="knows no pinch"):
        model("source").closed_by(0.5)


def test_without_variants_nothing_is_made_up() -> None:
    bare = Converged.of(surrogate.loaded(models.SHIPPED))
    assert not bare.has_variants
    with pytest.raises(DesignError, match="no variants"):
        bare.closed_by(0.5)
    with pytest.raises(DesignError, match="no variants"):
        predicted(bare, K0, LENGTH, ON)
    with pytest.raises(KeyError):
        PieceData(surrogate.loaded(models.beside(models.SHIPPED))).pinches(4)


# --- wants --------------------------------------------------------------------------------------------------


def test_directions_as_residuals() -> None:
    """Lever times angle: of a tangent the shortest turn, whatever its roll; of a frame all of it."""
    angle = 0.3
    c, s = math.cos(angle), math.sin(angle)
    yaw = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    roll = np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])
    along = Wants.of((0.0, 0.0, 0.0), tangent=(2.0, 0.0, 0.0))
    whole = Wants.of((0.0, 0.0, 0.0), tangent=(2.0, 0.0, 0.0), up=(0.4, 0.0, 3.0))
    both = np.stack((yaw, roll))
    np.testing.assert_allclose(np.linalg.norm(along.turn(both), axis=1), [30.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(whole.turn(both), [[0.0, 0.0, 30.0], [30.0, 0.0, 0.0]], atol=1e-9)
    assert Wants.of((0.0, 0.0, 0.0)).turn(both).shape == (2, 0)


@pytest.mark.parametrize(
    ("more", "told"),
    [
        ({"up": (0.0, 0.0, 1.0)}, "needs a tangent"),
        ({"tangent": (0.0, 0.0, 0.0)}, "no direction"),
        ({"tangent": (1.0, 0.0, 0.0), "up": (2.0, 0.0, 0.0)}, "no direction"),
        ({"stops": [(1.0, (1.0, 2.0, 3.0))]}, "0 < part < 1"),
        ({"stops": [(0.5, (1.0, 2.0, 3.0), 1.2)]}, "0 < along <= 1"),
        ({"keep_out": [[0.0, 0.0, 0.0, 1.0, 1.0, 0.0]]}, "no room"),
        ({"keep_out": [[0.0, 1.0]]}, "six numbers"),
        ({"keep_out": [[-5.0, -5.0, -5.0, 5.0, 5.0, 5.0]]}, "the start of the crease .* lies in a box"),
        ({"keep_out": [[90.0, 40.0, -5.0, 110.0, 60.0, 5.0]]}, r"the target \(100, 50, 0\) lies in a box"),
    ],
)
def test_bad_wants(more: dict[str, object], told: str) -> None:
    with pytest.raises(DesignError, match=told):
        Wants.of((100.0, 50.0, 0.0), **more)  # type: ignore[arg-type]


def test_boxes_are_kept_out_of() -> None:
    """A box on the strip, also between its nodes, and one beside it."""
    end = converged().forward(K0, LENGTH, ON)[0][-1]
    around = np.array([end - 4.0, end + 4.0])
    assert not Wants.of((0.0, 0.0, 90.0), keep_out=[around]).free(DESIGN, converged())
    assert Wants.of(end, keep_out=[around + 40.0]).free(DESIGN, converged())
    before = converged().unpinched(K0, LENGTH)[0][-1]  # and where the end is before the pinch
    assert not Wants.of(end, keep_out=[[before - 4.0, before + 4.0]]).free(DESIGN, converged())


def test_depth_in_a_box() -> None:
    """A box that the crease of a straight strip passes 2 mm beside its nearest side; a strip that is not there."""
    k0, length, on = np.zeros((1, 2)), np.full((1, 2), 100.0), np.zeros((1, 2), dtype=bool)
    box = np.array([[[80.0, -30.0, -1.0], [80.5, -2.0, 1.0]]])
    beside = depths(converged(), box, k0, length, on)
    assert beside.shape == (1, 2)
    assert not beside.any()  # the edges are 3.5 mm lower and 3.5 mm to the side
    box[:, 1, 1] = 2.0
    inside = depths(converged(), box, k0, length, on)[0]
    # the crease does not quite keep to the axis: one point of it is in there
    assert inside[0] == inside[1] == pytest.approx(0.25 + ROOM, abs=0.26)


def test_strips_are_moved_out_of_boxes() -> None:
    """A box of 20 mm round a point of the strip: the design goes round it and ends at the same place."""
    k0, length, on = np.array([0.006, -0.007, 0.003]), np.array([131.3, 120.0, 110.0]), np.array([[True] * 3])
    points = converged().forward(k0, length, on[0])[0]
    box = np.array([[points[1] - 10.0, points[1] + 10.0]])
    wants = Wants.of(points[-1], keep_out=box)
    problem = ReachAll(converged(), 3, target=wants.point, wants=wants, shift=np.zeros(1))
    before = problem.variables(Design(k0, length, on[0]))[None]
    assert not wants.free(problem.design(before[0], on[0]), converged())
    after = problem.polished(before, on)
    assert wants.free(problem.design(after[0], on[0]), converged())
    assert problem.off(problem.bare(after, on))[0][0] < 0.01


def test_the_nearest_designs_are_allowed_and_the_nearest() -> None:
    """As if all had been looked at, also where fewer are allowed than are asked for."""
    book = Library(converged(), 3, size=600)
    target = np.array([50.0, 60.0, 0.0])
    x, on, ends = book.designs
    fine = book.problem(target).violation(x, on) <= 0.0
    assert not fine.all()
    order = np.argsort(np.linalg.norm(ends - target, axis=1) + np.where(fine, 0.0, math.inf))
    for count in (7, 600):
        found, switches = book.nearest(target, count)
        assert len(found) == min(count, fine.sum())
        np.testing.assert_array_equal(found, x[order[: len(found)]])
        np.testing.assert_array_equal(switches, on[order[: len(found)]])


def test_a_design_is_found_again() -> None:
    """Its end with its frame, and where the end was half way: all of it is met by the whole strip."""
    points, frames = converged().forward(K0, LENGTH, ON)
    half = converged().closed_by(0.5).forward(K0, LENGTH, ON)[0][-1]
    wants = Wants.of(points[-1], frames[-1, :, 0], frames[-1, :, 2], stops=[(0.5, half)])
    start = np.array([[0.5, -0.5, 140.0, 125.0]])
    problem = ReachAll(converged(), 2, target=wants.point, wants=wants, shift=np.zeros(1))
    assert problem.bare(start, np.array([ON])).shape == (1, 9)
    x = descend(problem, problem.variables(DESIGN)[None] + [0.02, -0.02, 1.0, -1.0], np.array([ON]))
    missed, turned = problem.off(problem.bare(x, np.array([ON])))
    assert missed[0] < 0.01
    assert turned[0] < 1e-4
    landing, residuals, bar, turn_bar = problem.landed(problem.design(x[0], np.array(ON)))
    missed, turned = problem.off(residuals)
    assert missed < 0.5
    assert turned < math.radians(0.5)
    assert 0.0 < landing.bar <= bar < 1.0
    assert 0.0 < turn_bar < math.radians(0.5)


def test_points_of_the_crease() -> None:
    """Ends and joints are those of the chain, a point between is that of the simulated strip, half a pinch too."""
    arrays = np.array([K0]), np.array([LENGTH]), np.array([ON])
    model = converged().closed_by(0.5)
    points = model.forward(*arrays)[0][0]
    for share, point in zip((0.0, LENGTH[0] / sum(LENGTH), 1.0), points, strict=True):
        np.testing.assert_allclose(along(model, *arrays, share)[0], point, atol=1e-9)
    share = 0.35  # 22 mm behind the middle of the first pinch
    landing = model.land(K0, LENGTH, ON)
    beside = along_strip(landing.strip, share) - along(model.same_mesh, *arrays, share)[0]
    assert np.linalg.norm(beside) < 0.5
    assert np.linalg.norm(along_strip(landing.strip, 1.0) - landing.strip.t) < 1e-9


def test_a_design_with_a_point_on_the_way_is_found_again() -> None:
    """Where its end is, and where two thirds of its crease are when pinches are half closed."""
    arrays = np.array([K0]), np.array([LENGTH]), np.array([ON])
    end = converged().forward(*arrays)[0][0, -1]
    between = along(converged().closed_by(0.5), *arrays, 0.66)[0]
    wants = Wants.of(end, stops=[(0.5, between, 0.66)])
    problem = ReachAll(converged(), 2, target=end, wants=wants, shift=np.zeros(1))
    x = descend(problem, problem.variables(DESIGN)[None] + [0.02, -0.02, 1.0, -1.0], np.array([ON]))
    missed, _ = problem.off(problem.bare(x, np.array([ON])))
    assert missed[0] < 0.05


def test_a_point_with_a_direction() -> None:
    """The whole strip ends there and so; two segments have four variables, too few for a point and a direction."""
    target, tangent = (100.0, 100.0, 0.0), (-1.0, 0.0, 0.0)
    found = Reach(most=3)(Wants.of(target, tangent))
    assert found.design.n == 3
    assert found.missed_at_most <= 1.0
    assert found.turned_at_most <= math.radians(1.0)
    assert found.landing is not None
    assert found.landing.frame[0, 0] < -math.cos(math.radians(1.0))


@pytest.mark.slow
def test_robust_designs_move_less() -> None:
    """A fifth here, with one segment more and a descent on the movements; they still end where they should."""
    target = (50.0, 150.0, 0.0)
    short, robust = (Reach(verify=False, most=3, prefer=way)(target) for way in ("short", "robust"))
    moved = [
        float(predicted(converged(), d.k0, d.length, d.pinched).size) for d in (short.design, robust.design)
    ]
    assert moved[1] < 0.3 * moved[0]  # 0.37 without the descent on movements
    assert robust.missed <= 1.0
    assert short.design.total < robust.design.total


def test_a_zone_is_no_longer_than_its_segment() -> None:
    with pytest.raises(DesignError, match="longer than its segment of 35 mm"):
        simulate([0.0, 0.0], [35.0, 60.0], [True, False], converged().setting)


@pytest.mark.parametrize(
    ("wants", "told"),
    [
        (
            Wants.of((0.0, 0.0, 50.0)),
            r"no crease of one segment .*the nearest ends \d+(\.\d+)? mm away, at \(.*, .*, .*\)",
        ),
        (Wants.of((5000.0, 0.0, 0.0)), r"the nearest ends 4,700 mm away, at \(300, 0, 0\)"),
        (Wants.of((100.0, 60.0, -3.0), tangent=(-1.0, 0.0, 0.0)), r"mm away, \d+(\.\d+)? degrees off"),
        (
            Wants.of((100.0, 60.0, -3.0), keep_out=[[2.0, -30.0, -30.0, 20.0, 30.0, 30.0]]),
            "no strip that was looked at stays out of them",
        ),
    ],
)
def test_what_cannot_be_had(wants: Wants, told: str) -> None:
    """One line with the nearest that can."""
    with pytest.raises(DesignError, match=told) as error:
        Reach(most=1)(wants)
    assert "\n" not in str(error.value)


def test_the_crease_that_is_drawn_ends_where_its_strip_lands() -> None:
    """A strip on one mesh ends millimetres beside; what is drawn as its limit does not."""
    k0, length, pinched = [-0.012, -0.005], [170.0, 200.0], [True, False]
    end = converged().forward(k0, length, pinched)[0][-1] + [1.0, 0.0, -2.0]
    crease = landed(converged(), k0, length, pinched, end)
    np.testing.assert_allclose(crease[[0, -1]], [[0.0, 0.0, 0.0], end], atol=1e-12)
    assert np.linalg.norm(np.diff(crease, axis=0), axis=1).sum() == pytest.approx(370.0, rel=0.01)


def test_a_fit_that_cannot_be_cut_gives_way_to_one_of_fewer_segments() -> None:
    """An arc of 2 mm has no panels of 5 mm on its inner side."""
    one = FitCurve(np.array([[0.0, 0.0], [100.0, 10.0]]), 1)
    two = replace(one, n=2)
    tight, slack = (
        Found(np.array(x), np.zeros(0, dtype=bool), 0.0, allowed=True, evaluations=1)
        for x in ([4.0, 0.1, 8.0, 92.0], [0.2, 100.0])
    )
    problem, top, landing = folded_fit([(one, slack), (two, tight)], converged())
    assert problem is one
    assert top is slack
    assert landing.end[0] > 95.0
    with pytest.raises(
        DesignError, match="no fit of the curve can be cut and folded: the flat strip meets itself"
    ):
        folded_fit([(two, tight)], converged())


def test_a_tolerance_below_the_error_bar_is_told() -> None:
    """The model is not as sure as that, so what is asked for cannot be promised."""
    with pytest.raises(DesignError, match=r"with an error bar of 0\.\d+ mm: allow more than that"):
        Reach(most=2, tolerance=0.01)((-80.0, 100.0, -5.0))


def test_blocks_of_the_case_are_a_part_at_random() -> None:
    """Ten blocks have every target once, and segments do not depend on how many are drawn."""
    from verification.studies.ch6.landing import BLOCKS, aims, drawn

    every = [point for number in range(BLOCKS) for point in aims(number)]
    assert len(every) == len(set(every)) == 330
    assert len({z for _, _, z in aims(0)}) == 5
    assert drawn(8)[:4] == drawn(4)
