"""Suites: frozen scenarios on which policies are compared, and driving them."""

from sim.frozen import suite_names
from sim.suite_rules import SuiteRules
from sim.suites.driving import EpisodeTable, Observer, Situation, run_controller, run_suite
from sim.suites.places import BarnPlace, GeneratedPlace, ScenePlace, build_places, content_hash, suite_places
from sim.suites.suite import Suite, load_suite, suite_for, suite_in, suite_named, suite_of, suite_of_scenes

__all__ = [
    "BarnPlace",
    "EpisodeTable",
    "GeneratedPlace",
    "Observer",
    "ScenePlace",
    "Situation",
    "Suite",
    "SuiteRules",
    "build_places",
    "content_hash",
    "load_suite",
    "run_controller",
    "run_suite",
    "suite_for",
    "suite_in",
    "suite_named",
    "suite_names",
    "suite_of",
    "suite_of_scenes",
    "suite_places",
]
