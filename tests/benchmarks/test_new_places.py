"""The benchmark of the preset *New places*: its scenarios are nobody else's, and a good policy is told from a bad one."""

from benchmarks.new_places import scenarios, success
from sim.suites import load_suite
from workers.shipped.library import shipped_policy


def test_every_scenario_has_a_map_of_its_own_that_is_in_no_suite() -> None:
    suite = scenarios(30)
    assert len(suite.arenas) == len(set(suite.arena_indices.tolist())) == 30
    assert not {arena.name for arena in suite.arenas} & {arena.name for arena in load_suite("clutter-500").arenas}


def test_who_has_met_clutter_arrives_and_who_has_not_does_less() -> None:
    suite = scenarios(60)
    assert success(shipped_policy("clutter").archive, suite) >= 0.95
    assert success(shipped_policy("simple").archive, suite) < 0.9
