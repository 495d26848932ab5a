"""Whatever comes over a worker's link, or as an upload: what is stored is what was said, each item once; no 500."""

import hashlib
import json
from collections.abc import Iterator
from typing import Any

import pytest
from fastapi.testclient import TestClient
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pydantic import ValidationError
from sqlalchemy import delete, select, update

from server.app import create_services
from server.database import tables
from server.services import Services
from server.settings import Settings
from server.worker_api.batches import read_batch
from server.worker_api.ingest import Report
from server.worker_api.service import WorkerService
from tests.server.harness import WORKER_TOKEN
from workers.config import TrainingConfig
from workers.protocol import MAX_INTEGER, Orders

few = settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=12),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
    max_leaves=10,
)


def item(seq: int) -> dict[str, Any]:
    """The item of this number: the same whenever it is sent."""
    if seq % 3 == 0:
        return {"kind": "event", "seq": seq, "step": seq, "at": 1.0, "level": "info", "message": f"item {seq}"}
    return {"kind": "metrics", "seq": seq, "step": seq, "at": 1.0, "values": {"x": float(seq)}}


@st.composite
def damaged_items(draw: st.DrawFn, seq: int) -> Any:
    """An item that is none: a field of it is anything, or gone, or one too many; or all of it is anything."""
    whole: dict[str, Any] = item(seq)
    how = draw(st.sampled_from(["field", "gone", "more", "all"]))
    if how == "all":
        return draw(json_values)
    name = draw(st.sampled_from(sorted(set(whole) - {"seq"})))
    if how == "field":
        return whole | {name: draw(json_values)}
    if how == "more":
        return whole | {draw(st.text(min_size=1, max_size=5)): draw(json_values)}
    return {key: value for key, value in whole.items() if key != name}


@few
@given(text=st.text() | json_values.map(json.dumps) | st.builds(lambda items: json.dumps({"items": items}), json_values))
def test_any_text_is_a_batch_or_no_message(text: str) -> None:
    try:
        batch, refused = read_batch(text)
    except ValidationError:
        return
    assert len(batch.items) == 0 or refused is None


@few
@given(data=st.data(), before=st.integers(0, 4), behind=st.integers(0, 3))
def test_the_first_item_that_is_none_is_named_and_all_before_it_are_read(
    data: st.DataObject, before: int, behind: int
) -> None:
    first = before + 1
    damaged = data.draw(damaged_items(first))
    items = [*map(item, range(1, first)), damaged, *map(item, range(first + 1, first + 1 + behind))]
    try:
        batch, refused = read_batch(json.dumps({"items": items}))
    except ValidationError:
        # Nobody can tell which it was to be.
        seq = damaged.get("seq") if isinstance(damaged, dict) else None
        assert not isinstance(seq, int) or isinstance(seq, bool) or not 1 <= seq <= MAX_INTEGER
        return
    if refused is None:
        # Chance has made a whole one of it.
        assert len(batch.items) == len(items)
        return
    assert [one.seq for one in batch.items] == list(range(1, first))
    assert refused.seq == damaged["seq"]
    assert str(refused.seq) in refused.reason


@pytest.fixture
def services(settings: Settings, database_url: str) -> Iterator[Services]:
    services = create_services(settings.model_copy(update={"database_url": database_url}))
    with services.database.write() as session:
        session.add(tables.Experiment(id="e", name="x", training=TrainingConfig().model_dump(mode="json")))
        session.flush()
        session.add(tables.Run(id="r", experiment_id="e", seed=0, state="running", attempt=1, worker="w"))
    yield services
    services.database.dispose()


@settings(max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_whatever_is_sent_again_skipped_or_damaged_each_item_up_to_the_last_is_stored_once(
    services: Services, data: st.DataObject
) -> None:
    """The server acknowledges the longest beginning that it has heard of, whatever order and company it came in."""
    with services.database.write() as session:
        session.execute(delete(tables.MetricRow))
        session.execute(delete(tables.RunEvent))
        session.execute(update(tables.Run).values(last_seq=0))
    stored = 0
    for _ in range(data.draw(st.integers(1, 5))):
        start = data.draw(st.integers(max(1, stored - 3), stored + 2))
        count = data.draw(st.integers(0, 5))
        damaged_at = data.draw(st.none() | st.integers(0, 4))
        items = [
            item(seq) | ({"step": -1} if place == damaged_at else {})
            for place, seq in enumerate(range(start, start + count))
        ]
        batch, refused = read_batch(json.dumps({"items": items}))
        (orders,) = WorkerService(services).receive([Report("r", 1, batch, refused)])
        assert isinstance(orders, Orders)
        heard = start + len(batch.items) - 1
        if start <= stored + 1 and batch.items:
            stored = max(stored, heard)
        skipped = bool(batch.items) and start > stored + 1
        assert orders.ack == stored
        assert (orders.refused is not None) == (skipped or refused is not None)
    with services.database.read() as session:
        numbers = session.scalars(select(tables.MetricRow.seq).order_by(tables.MetricRow.seq)).all()
        messages = session.scalars(select(tables.RunEvent.message).order_by(tables.RunEvent.step)).all()
    assert list(numbers) == [seq for seq in range(1, stored + 1) if seq % 3]
    assert list(messages) == [f"item {seq}" for seq in range(1, stored + 1) if not seq % 3]


@settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_an_upload_of_anything_is_taken_or_refused_and_leaves_no_file_behind(
    client: TestClient, app_services: Services, data: st.DataObject
) -> None:
    archive = data.draw(st.binary(max_size=64))
    head: Any = {"after_seq": 0, "sha256": hashlib.sha256(archive).hexdigest(), "evaluation": None}
    if data.draw(st.booleans()):
        head[data.draw(st.sampled_from([*sorted(head), "more"]))] = data.draw(json_values)
    line = json.dumps(head).encode() if data.draw(st.booleans()) else data.draw(st.binary(max_size=64))
    step = data.draw(st.integers() | st.text(alphabet="0123456789abc.-+ ", min_size=1, max_size=5))
    response = client.put(
        f"/api/worker/runs/r/checkpoints/{step}",
        params={"attempt": data.draw(st.sampled_from(["1", "2", "0", "x", str(10**30)]))},
        content=line + data.draw(st.sampled_from([b"\n", b""])) + archive,
        headers={"Authorization": f"Bearer {WORKER_TOKEN}"},
    )
    assert response.status_code in {204, 404, 405, 409, 422, 425}, response.text
    with app_services.database.read() as session:
        assert app_services.files.ids() == set(session.scalars(select(tables.Checkpoint.id)))


@pytest.fixture
def app_services(client: TestClient) -> Services:
    """Of the application that the client asks, with a run that a worker has."""
    services: Services = client.app.state.services  # type: ignore[attr-defined]
    with services.database.write() as session:
        session.add(tables.Experiment(id="e", name="x", training=TrainingConfig().model_dump(mode="json")))
        session.flush()
        session.add(tables.Run(id="r", experiment_id="e", seed=0, state="running", attempt=1, worker="w"))
    return services
