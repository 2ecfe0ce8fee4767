"""A small version of each row of the studies' tables, and what makes a campaign trustworthy."""

import math
from dataclasses import replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import get_args, get_type_hints

import msgspec
import numpy as np
import pytest
from shapely.geometry import Point, Polygon

from companion import reach
from companion.cli import main
from companion.errors import ConfigError
from companion.instant import Instant, instant
from companion.planning.field import ExactRepulsion
from companion.planning.steering import Steering
from sitl.studies import age, options, ugv
from sitl.studies.campaign import RESULTS, Campaign, local_executor
from sitl.studies.case import Crossing, Readings
from sitl.studies.closest import to_the_hulls, to_the_sets
from sitl.studies.crossing import Crossed, cross
from sitl.studies.planners import PLANNERS
from sitl.studies.ships import Ships, draw, without_uncertainty
from sitl.studies.trials import Outcome, Part, parts, run_part
from sitl.studies.vehicles import Lag, Vehicles
from sitl.vehicle import Demand, KinematicSubmarine, Limits

SEED = 71
COARSE = Crossing(dt_s=0.5)  # the tables have 0.1


def outcomes(planner: str, trials: int = 10, case: Crossing = COARSE) -> list[Outcome]:
    found = run_part(case, SEED, Part(planner, 0, trials))
    if case.readings.obstacle == "hull" and case.readings.noise != "none":
        assert all(o.to_set_m <= o.to_hull_m for o in found)  # a set holds its ship's hull
    return found


def with_readings(case: Crossing, **readings: str) -> Crossing:
    return msgspec.structs.replace(case, readings=msgspec.structs.replace(case.readings, **readings))


# ---------------------------------------------------------------- the rows


def test_the_exact_planner_keeps_the_distance_of_its_force_balance() -> None:
    found = outcomes("exact", 20)
    least = min(o.to_set_m for o in found)
    assert least == pytest.approx(5 + (15000 / 5) ** (1 / 3), abs=0.5)  # 19.4; the paper: 18.8
    assert all(o.arrived for o in found)
    assert 690 < float(np.median([o.time_s for o in found if o.time_s])) < 780  # the paper: about 12 min


def test_the_network_in_place_of_the_exact_sets_changes_no_minimum_by_half_a_metre() -> None:
    for learned, exact in zip(outcomes("network"), outcomes("exact"), strict=True):
        assert learned.to_set_m == pytest.approx(exact.to_set_m, abs=0.5)


def test_without_uncertainty_half_of_the_trials_fail() -> None:
    found = outcomes("no-uncertainty", 20)
    assert sum(o.to_set_m < 5.0 for o in found) >= 10  # the paper: 11 of 20


@pytest.mark.parametrize("ships", ["convoy", "stream"])
def test_the_improved_planner_crosses_convoy_and_stream_with_a_lagging_vehicle(ships: str) -> None:
    case = with_readings(COARSE, ships=ships, vehicle="lag")
    found = outcomes("improved-exact", 20, case)
    assert min(o.to_set_m for o in found) >= 15.0
    times = [o.time_s for o in found if o.time_s]
    assert len(times) == len(found)
    assert np.median(times) <= 725
    assert np.quantile(times, 0.95) <= 765


def test_the_improved_planner_by_network_does_what_it_does_by_the_exact_sets() -> None:
    case = with_readings(COARSE, vehicle="lag")
    for learned, exact in zip(
        outcomes("improved", 4, case), outcomes("improved-exact", 4, case), strict=True
    ):
        assert learned.to_set_m == pytest.approx(exact.to_set_m, abs=0.5)


def test_a_search_in_space_and_time_is_faster_than_any_field_and_keeps_delta() -> None:
    found = outcomes("search", 5)
    assert min(o.to_set_m for o in found) >= 5.0
    field = outcomes("improved-exact", 5)
    pairs = [(s.time_s, f.time_s) for s, f in zip(found, field, strict=True)]
    assert all(s is not None and f is not None and s <= f + 5 for s, f in pairs)


@pytest.mark.parametrize("variant", list(ugv.VARIANTS))
def test_the_ground_vehicle_keeps_its_distance_by_its_own_network(variant: str) -> None:
    case = ugv.case_of(variant, "integrator")
    assert all(o.to_set_m >= 0.51 and o.arrived for o in outcomes("network", 20, case))


@pytest.mark.parametrize(("variant", "paper_m"), [("opposite", 0.5826), ("same", 0.6160)])
def test_the_papers_ground_vehicle_figures_come_from_k_r_of_a_hundredth(variant: str, paper_m: float) -> None:
    literal = ugv.case_of(variant, "integrator", k_r=0.01, attraction="proportional")
    found = outcomes("exact", 20, literal)
    assert float(np.median([o.to_hull_m for o in found])) == pytest.approx(paper_m, abs=0.02)
    printed = ugv.case_of(variant, "integrator", attraction="proportional", k_r=10.0)
    assert min(o.to_hull_m for o in outcomes("exact", 20, printed)) > 1.0


def test_information_too_old_is_held_with_and_fresh_information_is_crossed_on() -> None:
    fresh = msgspec.structs.replace(age.case_of(0), dt_s=0.5, time_limit_s=300.0)
    old = msgspec.structs.replace(age.case_of(600), dt_s=0.5, time_limit_s=120.0)
    assert all(o.arrived and o.to_set_m >= 5 for o in outcomes("rehearsed", 2, fresh))
    assert all(not o.arrived and o.to_set_m >= 5 for o in outcomes("rehearsed", 2, old))


def test_the_whole_line_through_encoded_bytes_keeps_its_distance_too() -> None:
    case = with_readings(Crossing(before_m=120.0, beyond_m=60.0, meets_s=-120.0), vehicle="sitl")
    (found,) = outcomes("improved-exact", 1, case)
    assert found.arrived
    assert found.to_set_m >= 15.0


@pytest.mark.parametrize("variant", list(ugv.VARIANTS))
def test_the_bundled_rover_keeps_its_distance_through_encoded_bytes(variant: str) -> None:
    for planner in ("exact", "network"):
        (found,) = outcomes(planner, 1, ugv.case_of(variant, "sitl"))
        assert found.arrived
        assert found.to_set_m >= 0.51
        assert (
            found.to_hull_m >= 1.77
        )  # force balance, 0.51 + (10 / 5)^(1/3); its sets are wider than the hulls


# ---------------------------------------------------------------- the same code, the same numbers


def test_many_vehicles_at_once_want_what_each_wants_alone() -> None:
    case = with_readings(COARSE, ships="stream")
    ships = draw(case, SEED, range(3))
    k = ships.per_trial
    settings = case.settings({"horizon": "clearing"})
    steering = Steering(settings, ExactRepulsion(settings.field))
    place, goal = np.array(((3.0, 20.0), (-8.0, 90.0), (0.0, -400.0))), np.array(case.goal_m)
    now = instant(400.0)
    push = steering.push(ships.reported, now, np.repeat(place, k, axis=0), goal)
    together = steering.horizontal(ships.reported, np.zeros((3, 2)), push)
    for v in range(3):
        mine = reach.shapes.only(ships.reported, np.arange(v * k, (v + 1) * k))
        alone = steering.horizontal(mine, np.zeros(2), steering.push(mine, now, place[v], goal))
        assert together[v] == pytest.approx(alone, rel=1e-12, abs=1e-12)


def test_a_trials_ships_depend_on_its_number_alone() -> None:
    together, alone = draw(COARSE, SEED, range(5)), draw(COARSE, SEED, range(3, 4))
    k = together.per_trial
    assert together.reported.north_m[3 * k : 4 * k].tolist() == alone.reported.north_m.tolist()
    later = instant(500.0)
    assert together.truth(later).north_m[3 * k : 4 * k].tolist() == alone.truth(later).north_m.tolist()


@pytest.mark.parametrize("noise", ["constant", "interval", "white", "none"])
def test_every_noise_keeps_the_ships_in_their_sets(noise: str) -> None:
    ships = draw(with_readings(COARSE, noise=noise), SEED, range(4))
    for seconds in (190.0, 300.0, 700.0):
        t = instant(seconds)
        truth = ships.truth(t)
        sets = reach.at(ships.reported, t)
        for ahead, right in ((37.5, 12.5), (-37.5, 12.5), (37.5, -12.5), (-37.5, -12.5)):
            cos, sin = np.cos(truth.heading_rad), np.sin(truth.heading_rad)
            corner = np.column_stack(
                (truth.north_m + ahead * cos - right * sin, truth.east_m + ahead * sin + right * cos)
            )
            assert sets.nearest(corner).distance_m.max() < 1e-9


def crossed(ships: Ships, planner: str = "no-uncertainty") -> Crossed:
    return cross(COARSE, ships, lambda tracks, m: PLANNERS[planner].make(COARSE, tracks, m, "numpy"))


def test_the_closest_approaches_are_those_of_every_step_computed_by_shapely() -> None:
    ships = draw(COARSE, SEED, range(2))
    run = crossed(ships)
    sets, hulls = to_the_sets(run.paths, ships), to_the_hulls(run.paths, ships)
    k = ships.per_trial
    for trial in range(2):
        path = run.paths.position_m[: run.paths.last[trial] + 1, trial]
        every = [
            reach.at(ships.reported, Instant(int(t))).nearest(p).distance_m[trial * k : (trial + 1) * k].min()
            for t, p in zip(run.paths.t_ns, path, strict=False)
        ]
        assert sets.distance_m[trial] == pytest.approx(min(every), abs=1e-9)
        step = int(sets.step[trial])
        moment = reach.at(ships.reported, Instant(int(run.paths.t_ns[step])))
        outlines = [Polygon(moment.outline(i)) for i in range(trial * k, (trial + 1) * k)]
        here = Point(path[step])
        assert sets.distance_m[trial] == pytest.approx(min(o.distance(here) for o in outlines), abs=0.01)
        step = int(hulls.step[trial])
        truth = reach.at(ships.truth(Instant(int(run.paths.t_ns[step]))), Instant(int(run.paths.t_ns[step])))
        near = truth.nearest(path[step]).distance_m[trial * k : (trial + 1) * k].min()
        assert hulls.distance_m[trial] == pytest.approx(near, abs=1e-9)


def test_the_lagging_vehicle_is_the_bundled_kinematic_one() -> None:
    rng = np.random.default_rng(3)
    wanted = rng.uniform(-2.5, 2.5, (80, 2))
    many = Vehicles.at_rest(1, (0.0, 0.0), 0.3)
    hull = KinematicSubmarine(Limits())
    one = hull.start(0.0, 0.0, 0.0, 0.3)
    for u in np.repeat(wanted, 5, axis=0):
        many = Lag(2.5).step(many, u[None], 0.1)
        one = hull.step(one, Demand((float(u[0]), float(u[1]), 0.0)), 0.1)
    assert many.position_m[0] == pytest.approx((one.north_m, one.east_m), abs=1e-9)
    assert math.cos(float(many.heading_rad[0]) - one.heading_rad) == pytest.approx(1.0)


def test_without_uncertainty_only_the_bounds_are_gone() -> None:
    reported = draw(COARSE, SEED, range(1)).reported
    believed = without_uncertainty(reported)
    assert not believed.speed_noise_mps.any()
    assert not believed.course_noise_rad.any()
    assert (
        replace(believed, speed_noise_mps=reported.speed_noise_mps).bow_m.tolist() == reported.bow_m.tolist()
    )


def test_streams_have_no_end_and_convoys_five_ships_a_lane() -> None:
    assert draw(COARSE, SEED, range(1)).per_trial == 10
    stream = draw(with_readings(COARSE, ships="stream"), SEED, range(1))
    for lane in (57.5, 172.5):
        north = np.sort(stream.reported.north_m[stream.reported.east_m == lane])
        assert all(b - a == pytest.approx(450.0) for a, b in pairwise(north))
        assert north[-1] - north[0] > 5.05 * 1000


# ---------------------------------------------------------------- campaigns


def double(part: Part) -> list[Outcome]:
    return [
        Outcome(part.planner, part.first + i, True, 1.0, 2.0 * part.first, 0.0, 3.0, 4.0, None)
        for i in range(part.count)
    ]


def test_a_campaign_goes_on_where_it_stopped_and_forgets_a_torn_line(tmp_path: Path) -> None:
    todo = parts(("a", "b"), 250)
    identity = {"seed": 1, "case": COARSE}
    first = Campaign(tmp_path, identity, Part, Outcome)
    whole = first.run(double, todo, local_executor(1))
    lines = (tmp_path / RESULTS).read_bytes().split(b"\n")
    (tmp_path / RESULTS).write_bytes(b"\n".join(lines[:3]) + b"\n" + lines[3][:20])
    done: list[Part] = []
    again = Campaign(tmp_path, identity, Part, Outcome)
    assert len(again.done) == 2
    resumed = again.run(double, todo, local_executor(1), lambda part, _: done.append(part))
    assert resumed == whole
    assert len(done) == len(todo) - 2


def test_a_folder_belongs_to_one_campaign(tmp_path: Path) -> None:
    Campaign(tmp_path, {"seed": 1}, Part, Outcome)
    with pytest.raises(ConfigError, match="another campaign"):
        Campaign(tmp_path, {"seed": 2}, Part, Outcome)


def test_two_processes_find_what_one_finds(tmp_path: Path) -> None:
    work = partial(run_part, COARSE, SEED)
    todo = [Part("exact", 0, 2), Part("exact", 100, 2), Part("no-uncertainty", 0, 2)]
    found = [
        Campaign(tmp_path / str(jobs), {}, Part, Outcome).run(work, todo, local_executor(jobs))
        for jobs in (1, 2)
    ]
    assert found[0] == found[1]


def test_the_readings_on_the_command_line_are_those_of_the_case() -> None:
    hints = get_type_hints(Readings)
    offered = {name: set(choices) for name, (choices, _) in options.READINGS.items()}
    assert offered == {name: set(get_args(hint)) for name, hint in hints.items()}
    defaults = {name: choices[0] for name, (choices, _) in options.READINGS.items()}
    assert defaults == msgspec.to_builtins(Readings())


def test_the_command_writes_its_tables_and_says_when_a_claim_is_broken(tmp_path: Path) -> None:
    good = tmp_path / "good"
    said = ["study", "uuv", "--trials", "1", "--jobs", "1", "--planners", "exact", "--out", str(good)]
    assert main(said) == 0
    made = {path.name for path in good.iterdir()}
    assert {"table.md", "table.csv", "study.json", "distances.png", "snapshots.png", RESULTS} <= made
    assert "| exact | 1 | 1 | 19.4" in (good / "table.md").read_text()
    known = msgspec.json.decode((good / "study.json").read_bytes())
    assert known["seed"] == 1
    assert known["case"]["readings"]["noise"] == "constant"
    assert main([*said[:-3], "nonsense", "--out", str(good)]) == 2
