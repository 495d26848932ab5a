"""A policy on a frozen suite: one result per scenario."""

from sim.arrays import PolicyFunction
from sim.config import TaskConfig
from sim.suites import EpisodeTable, Suite, run_suite
from workers.reporting import EpisodeResult, EvaluationResult, Outcome

# As `NavigationVectorEnv.outcomes` counts them, from 1.
_OUTCOMES: tuple[Outcome, ...] = ("arrival", "collision", "timeout")


def evaluate(policy: PolicyFunction, task: TaskConfig, suite: Suite) -> EvaluationResult:
    """Drives every scenario of a suite once.

    Args:
        policy: observations to actions, deterministic.
        task: the robot, its sensors, the observation and the limits; the arena is the suite's.
        suite: where each attempt starts and where it should arrive.
    """
    return to_result(run_suite(policy, task, suite), suite)


def to_result(table: EpisodeTable, suite: Suite) -> EvaluationResult:
    """What was done in a suite, as it is reported."""
    episodes = tuple(
        EpisodeResult(
            outcome=_OUTCOMES[outcome - 1],
            steps=steps,
            reward=reward,
            path_length=path_length,
            shortest_path=shortest_path,
            min_clearance=min_clearance,
        )
        for outcome, steps, reward, path_length, shortest_path, min_clearance in zip(
            table.outcomes.tolist(),
            table.steps.tolist(),
            table.rewards.tolist(),
            table.path_lengths.tolist(),
            table.shortest_paths.tolist(),
            table.min_clearances.tolist(),
            strict=True,
        )
    )
    return EvaluationResult(suite=suite.name, suite_hash=suite.hash, episodes=episodes)


def evaluation_metrics(result: EvaluationResult, arrival_distance: float) -> dict[str, float]:
    """An evaluation as the curves show it.

    Steps and path efficiency (`EpisodeResult.path_efficiency`) are means over arrivals, absent where there were none. Reward
    is per step, return per episode.

    Args:
        result: of one policy on one suite.
        arrival_distance: of the task, metres.
    """
    count = len(result.episodes)
    arrivals = [episode for episode in result.episodes if episode.outcome == "arrival"]
    returns = sum(episode.reward for episode in result.episodes)
    metrics = {
        "eval/success_rate": len(arrivals) / count,
        "eval/collision_rate": sum(episode.outcome == "collision" for episode in result.episodes) / count,
        "eval/timeout_rate": sum(episode.outcome == "timeout" for episode in result.episodes) / count,
        "eval/return": returns / count,
        "eval/reward": returns / max(1, sum(episode.steps for episode in result.episodes)),
    }
    if arrivals:
        metrics["eval/steps"] = sum(episode.steps for episode in arrivals) / len(arrivals)
        efficiencies = [episode.path_efficiency(arrival_distance) for episode in arrivals]
        metrics["eval/path_efficiency"] = sum(efficiencies) / len(arrivals)
    return metrics
