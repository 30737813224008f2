"""The surrogate against simulation, self-intersection, the optimisers, and the source's three problems."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("xarray")
from bh.applications.inverse import surrogate as stored
from bh.applications.inverse.optimisers import Evolution, Genetic, Optimiser, Polished, best, polish
from bh.applications.inverse.problems import CURVES, FitCurve, MoveTip, ReachPoint, resample
from bh.applications.inverse.reach import Reach
from bh.applications.inverse.segments import DesignError
from bh.applications.inverse.self_intersection import Projected, Swept, planar
from bh.applications.inverse.simulate import SegmentTask, simulate
from bh.applications.inverse.surrogate import Surrogate, shipped
from bh.applications.inverse.transforms import angles, matrix

# --- the surrogate ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("k0", "length"), [(0.0, 100.0), (-0.0095, 200.0), (0.007, 300.0), (0.02, 108.0)])
def test_surrogate_is_the_data_at_grid_points(k0: float, length: float) -> None:
    """And the data are what this version simulates."""
    found = SegmentTask()({"k0": k0, "length": length})
    t, uvw = shipped().pinched(k0, length)
    np.testing.assert_allclose(t, found["t"], atol=0.02)
    np.testing.assert_allclose(uvw, found["uvw"], atol=1e-4)


def test_surrogate_between_grid_points() -> None:
    """A few of the 200 of the case `forward`; at an odd length the middle lies between two nodes."""
    for k0, length in ((0.01234, 143.0), (-0.00321, 250.7), (0.0071, 299.1)):
        found = SegmentTask()({"k0": k0, "length": length})
        t, uvw = shipped().pinched(k0, length)
        assert np.linalg.norm(t - found["t"]) < 0.3
        turn = matrix(uvw).T @ matrix(found["uvw"])
        assert np.linalg.norm(angles(turn)) < math.radians(0.3)


def test_surrogate_is_symmetric() -> None:
    k0, length = np.array([0.003, 0.011, 0.0072]), np.array([290.0, 133.0, 201.0])
    (t, uvw), (t2, uvw2) = (shipped().pinched(sign * k0, length) for sign in (1.0, -1.0))
    np.testing.assert_allclose(t2, t * [1.0, -1.0, 1.0], atol=1e-6)
    np.testing.assert_allclose(uvw2, uvw * [-1.0, 1.0, -1.0], atol=1e-6)


def test_a_whole_strip_ends_where_the_surrogate_says() -> None:
    k0, length, on = [0.006, -0.005, 0.002], [120.0, 143.0, 110.0], [True, False, True]
    end = shipped().forward(k0, length, on)[0][-1]
    assert np.linalg.norm(simulate(k0, length, on).t - end) < 0.5


def test_forward_is_vectorised() -> None:
    rng = np.random.default_rng(1)
    length = rng.uniform(100.0, 300.0, (3, 5, 4))
    k0 = rng.uniform(-1.0, 1.0, length.shape) * shipped().domain.largest_curvature(length)
    on = rng.random(length.shape) < 0.5
    points, frames = shipped().forward(k0, length, on)
    assert points.shape == (3, 5, 5, 3)
    one, _ = shipped().forward(k0[1, 2], length[1, 2], on[1, 2])
    np.testing.assert_allclose(points[1, 2], one, atol=1e-11)
    np.testing.assert_allclose(
        frames @ np.swapaxes(frames, -1, -2), np.broadcast_to(np.eye(3), frames.shape), atol=1e-12
    )


def test_bad_data(tmp_path: Path) -> None:
    with pytest.raises(DesignError, match="outside the data set"):
        shipped().pinched(0.015, 250.0)
    with pytest.raises(DesignError, match="there is no data set"):
        stored.read(tmp_path / "none.nc")
    (tmp_path / "text.nc").write_text("no data")
    with pytest.raises(DesignError, match="no data set that can be read"):
        stored.read(tmp_path / "text.nc")
    import xarray

    with xarray.open_dataset(stored.SHIPPED, engine="h5netcdf") as data:
        other = data.load().assign_attrs(format=0)
    with pytest.raises(DesignError, match="format 0, this version reads 1"):
        Surrogate.of(other)
    with pytest.raises(DesignError, match="too few segments"):
        Surrogate.of(other.assign_attrs(format=1).isel(point=other["k0"].values < 0.004))


# --- self-intersection --------------------------------------------------------------------------------------


def test_projected_polygons() -> None:
    bow = [[0, 0], [2, 2], [2, 0], [0, 2]]
    hook = [[0, 0], [2, 0], [2, 1], [0, 1]]
    closed = [[0, 0], [2, 0], [1, 1], [0, 0]]
    back = [[0, 0], [2, 0], [1, 0], [1, 1]]
    assert planar(np.array([bow, hook, closed, back], dtype=float)).tolist() == [True, False, False, True]


def test_strips_in_space() -> None:
    """A full circle of two half circles is refused; a helix that the projection refuses passes above itself."""
    s = shipped()
    k = 0.0105
    assert Swept().meets(s, np.full(3, k), np.full(3, 200.0), np.zeros(3, dtype=bool))
    helix = np.array([0.0027, 0.0084, 0.0047]), np.array([215.0, 122.0, 284.0]), np.ones(3, dtype=bool)
    assert Projected().measure(s, *(x[None] for x in helix)).tolist() == [1.0]
    assert not Swept().meets(s, *helix)
    points = s.forward(*helix)[0]
    assert not Swept().meets(s, np.array([0.005]), np.array([150.0]), np.array([True]))
    # the drawn crease ends where the chain does, in the same frame
    crease, frames = Swept().crease(s, *helix)
    np.testing.assert_allclose(crease[-1], points[-1], atol=1e-9)
    np.testing.assert_allclose(frames[-1], s.forward(*helix)[1][-1], atol=1e-9)


def test_drawn_strip_is_close_to_the_simulated_one() -> None:
    k0, length, on = [0.006, 0.004], [150.0, 130.0], [True, True]
    drawn, _ = Swept(cell=1.0).crease(shipped(), np.array(k0), np.array(length), np.array(on))
    crease = simulate(k0, length, on).crease()
    assert np.linalg.norm(drawn - crease, axis=1).max() < 3.0


# --- optimisers ---------------------------------------------------------------------------------------------


class Bowl:
    """(x - a)^2 summed, one more for every switch that is not as it should be; forbidden left of x0 = 0."""

    lower, upper, switches = np.full(3, -1.0), np.full(3, 2.0), 2
    a = np.array([0.5, -0.25, 1.5])

    def evaluate(self, x: np.ndarray, on: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        value = ((x - self.a) ** 2).sum(axis=1) + (on != np.array([True, False])).sum(axis=1)
        return value, np.maximum(0.0, -x[:, 0])


@pytest.mark.parametrize(
    "optimiser", [Polished(Genetic(60, 40)), Polished(Evolution(8, 60))], ids=["GA", "DE"]
)
def test_optimisers_find_the_bottom(optimiser: Optimiser) -> None:
    if isinstance(optimiser, Polished) and isinstance(optimiser.first, Genetic):
        pytest.importorskip("pymoo")
    found = optimiser.minimise(Bowl(), seed=3)
    assert found.value < 1e-8
    assert found.allowed
    assert found.on.tolist() == [True, False]
    again = optimiser.minimise(Bowl(), seed=3)
    assert again.x.tobytes() == found.x.tobytes()


def test_polish_keeps_to_the_rules() -> None:
    class Walled(Bowl):
        a = np.array([-0.5, 0.0, 0.0])

    start = best(Walled(), np.array([[0.1, 0.3, 0.3]]), np.array([[True, False]]))
    found = polish(Walled(), start.x, start.on)
    assert found.allowed
    assert found.value <= start.value


# --- problems A, B, C ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", list(CURVES))
def test_target_curves_are_300_mm_long(name: str) -> None:
    """As the source says of Eq. 6.17 to 6.19, to its four digits."""
    length = np.linalg.norm(np.diff(CURVES[name], axis=0), axis=1).sum()
    assert length == pytest.approx(300.0, abs=0.06)
    np.testing.assert_allclose(CURVES[name][0], 0.0, atol=1e-12)


def test_fit_of_an_arc_is_exact() -> None:
    """Three quarters of a circle are one segment, and two arcs are two."""
    turn = np.linspace(0.0, 1.5 * math.pi, 2001)
    arc = 40.0 * np.column_stack((np.sin(turn), 1.0 - np.cos(turn)))
    problem = FitCurve(arc, 1)
    found = polish(problem, np.array([3.0, 150.0]), np.zeros(0, dtype=bool))
    assert found.value < 1e-5
    design = problem.design(found.x)
    assert design.total == pytest.approx(40.0 * 1.5 * math.pi, rel=1e-4)
    assert design.k0[0] == pytest.approx(math.sin(math.pi / 4) / 40.0, rel=1e-4)


def test_fit_measures_equal_distances() -> None:
    """Two designs at once, points on the crease at equal arc lengths."""
    problem = FitCurve(CURVES["cosine"], 2)
    x = np.array([[0.5, -1.0, 120.0, 180.0], [0.0, 0.0, 100.0, 200.0]])
    points = problem.points(x)
    steps = np.linalg.norm(np.diff(points, axis=1), axis=-1)
    np.testing.assert_allclose(steps[1], 3.0, rtol=1e-12)
    assert (steps[0] <= 3.0 + 1e-12).all()
    np.testing.assert_allclose(points[1, -1], [300.0, 0.0], atol=1e-9)


def test_bad_curves() -> None:
    with pytest.raises(DesignError, match="two points"):
        resample([[0.0, 0.0]], 5)
    with pytest.raises(DesignError, match="no length"):
        resample([[1.0, 1.0], [1.0, 1.0]], 5)


def test_tip_moves_only_by_pinches() -> None:
    problem = MoveTip(shipped(), 2)
    x = np.array([[0.4, 0.1, 200.0, 150.0]] * 2)
    value, _ = problem.evaluate(x, np.array([[False, False], [True, False]]))
    assert value[0] == 0.0
    assert value[1] < -10.0


def test_variables_are_the_domain() -> None:
    problem = ReachPoint(shipped(), 3, target=np.zeros(3))
    rng = np.random.default_rng(2)
    x = problem.lower + (problem.upper - problem.lower) * rng.random((500, 6))
    k0, length = problem.split(x)
    assert shipped().domain.holds(k0, length).all()
    np.testing.assert_allclose(
        problem.variables(problem.design(x[0], np.zeros(3, dtype=bool))), x[0], atol=1e-12
    )


@pytest.mark.parametrize("target", [(80.0, 80.0, 0.0), (-80.0, 80.0, -10.0)])
def test_a_point_is_reached(target: tuple[float, float, float]) -> None:
    """By the whole simulated strip, and its mirror image by the mirrored design."""
    found = Reach(model="source")(target)
    assert found.missed_simulated <= 1.0
    assert found.clear
    mirrored = found.design.mirrored()
    strip = simulate(mirrored.k0.tolist(), mirrored.length.tolist(), mirrored.pinched.tolist())
    np.testing.assert_allclose(strip.t, found.simulated.t * [1.0, -1.0, 1.0], atol=1e-6)  # type: ignore[union-attr]


def test_out_of_reach() -> None:
    with pytest.raises(DesignError, match="no crease of one segment was found"):
        Reach(most=1, model="source")((0.0, 0.0, 50.0))
    with pytest.raises(DesignError, match="three coordinates"):
        Reach(model="source")((0.0, 0.0))


def test_projected_rule_is_the_sources() -> None:
    """Chords that cross when folded are forbidden, whatever the pinches do."""
    rule = Projected()
    k0, length = np.array([[0.01, 0.01, 0.01]]), np.array([[200.0, 200.0, 200.0]])
    assert rule.measure(shipped(), k0, length, np.zeros((1, 3), dtype=bool)).tolist() == [1.0]
    assert rule.measure(shipped(), 0.2 * k0, length, np.zeros((1, 3), dtype=bool)).tolist() == [0.0]


@pytest.mark.slow
def test_shorter_creases_miss_by_more() -> None:
    """A front: longer the nearer, allowed by the rules, and shorter than what reaches the point without asking."""
    from bh.applications.inverse.pareto import pareto

    target = (60.0, 60.0, 10.0)
    front = pareto(target, allowances=(0.1, 10.0), most=3, starts=6, name="source")
    missed, total = ([getattr(trade, name) for trade in front] for name in ("missed", "total"))
    assert len(front) > 1
    assert missed == sorted(missed)
    assert total == sorted(total, reverse=True)
    assert missed[0] <= 0.11
    assert total[0] < 0.8 * Reach(verify=False, model="source")(target).design.total
    for trade in front:
        end = shipped().forward(*trade.design.lists())[0][-1]
        assert np.linalg.norm(end - target) == pytest.approx(trade.missed, abs=1e-9)
    with pytest.raises(DesignError, match="allow more"):
        pareto((900.0, 0.0, 0.0), most=1, name="source")


def test_python_of_the_page_runs() -> None:
    """docs/inverse_design.md, without the picture at its end."""
    page = (Path(__file__).resolve().parents[2] / "docs" / "inverse_design.md").read_text(encoding="utf-8")
    block = page.split("```python\n")[1].split("```")[0]
    lines = [row for row in block.splitlines() if ".plot()" not in row]
    assert len(lines) <= 10
    names: dict[str, object] = {}
    exec("\n".join(lines), names)
    assert names["found"].missed_simulated <= 1.0  # type: ignore[attr-defined]
