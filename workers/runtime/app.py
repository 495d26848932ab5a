"""The Celery application: a doorbell. A message names a run and the attempt that it was published for; nothing else matters.

Losing a message or delivering it twice does no harm (the claim decides who trains), so messages are acknowledged early,
nothing is stored as a result, and no worker hoards messages.
"""

from celery import Celery
from kombu.transport.sqlalchemy import Transport as SqlAlchemyTransport

TRAIN_TASK = "mapless.train"

# How often an idle worker of the embedded broker looks for work. A class attribute, for the transport passes its options on
# to SQLAlchemy, which refuses this one.
_POLLING_SECONDS = 0.1


def create_app(broker_url: str) -> Celery:
    """The application on a broker; servers publish with it, workers run it."""
    SqlAlchemyTransport.polling_interval = _POLLING_SECONDS
    app = Celery("mapless", broker=broker_url, include=["workers.runtime.tasks"], set_as_current=False)
    app.conf.update(
        accept_content=["json"],
        task_serializer="json",
        result_backend=None,
        task_ignore_result=True,
        task_acks_late=False,
        # Nobody steers workers over the broker: what they should do stands in the database.
        worker_enable_remote_control=False,
        worker_prefetch_multiplier=1,
        # On Redis a message waiting in a busy worker would be delivered to another one after the visibility time-out.
        worker_disable_prefetch=broker_url.startswith(("redis", "rediss", "unix")),
        broker_connection_retry_on_startup=True,
        # As long as it takes: Celery's own hundred tries are over after less than an hour.
        broker_connection_max_retries=None,
        # What Celery will do by itself one day, and warns of where nobody has said so. Of ours it cancels nothing: no task
        # of this application is acknowledged late.
        worker_cancel_long_running_tasks_on_connection_loss=True,
        broker_transport_options=_transport_options(broker_url),
        worker_hijack_root_logger=True,
        worker_send_task_events=False,
    )
    return app


def _transport_options(broker_url: str) -> dict[str, float]:
    """So that a broker that is away costs the one who rings seconds, not minutes."""
    if broker_url.startswith(("redis", "rediss")):
        return {"socket_connect_timeout": 3.0, "socket_timeout": 10.0}
    return {}
