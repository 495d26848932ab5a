"""`python -m benchmarks.load.views`: browsers that watch runs, each over the live view's own socket."""

import asyncio
import time

from websockets.asyncio.client import connect
from websockets.exceptions import WebSocketException
from websockets.typing import Subprotocol

from benchmarks.load.lag import watch_lag
from benchmarks.load.plan import Plan, ViewsTold, await_beginning, read_plan, tell
from server.live.page import VISER_PROTOCOL


async def _watch(plan: Plan, run_id: str, told: ViewsTold) -> None:
    url = f"{plan.server_url.replace('http', 'ws', 1)}/live/{run_id}/light"
    while not plan.over:
        opened = time.time()
        try:
            async with (
                asyncio.timeout(plan.end - opened),
                connect(
                    url,
                    subprotocols=[Subprotocol(VISER_PROTOCOL)],
                    additional_headers={"Authorization": f"Bearer {plan.token}", "Origin": plan.server_url},
                    compression=None,
                    max_size=None,
                    proxy=None,
                ) as socket,
            ):
                async for message in socket:
                    if plan.settled:
                        told.messages += 1
                        told.bytes += len(message)
        except TimeoutError:
            return
        except (OSError, WebSocketException):
            await asyncio.sleep(1.0)
        finally:
            told.seconds += time.time() - max(opened, plan.end - plan.seconds + plan.settling_seconds)
        told.ended += 1


async def watch(plan: Plan) -> ViewsTold:
    """The first runs, one view each, until the end of the plan; one that ends is opened again."""
    told = ViewsTold()
    async with asyncio.TaskGroup() as group:
        group.create_task(watch_lag(plan, told.lags))
        for run_id in plan.run_ids[: plan.views]:
            group.create_task(_watch(plan, run_id, told))
    return told


if __name__ == "__main__":
    tell(asyncio.run(watch(await_beginning(read_plan()))))
