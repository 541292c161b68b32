"""Connection to a Ray cluster."""

import contextlib
import signal
import threading
from collections.abc import Iterator
from typing import Any

from drone_rl.utils.errors import InputError, extra


def connect(address: str | None, choice: str) -> tuple[Any, bool]:
    """Return the module ray, connected to a cluster, and whether it was not connected before.

    Args:
        address: Address of the cluster; "local" starts one on this machine, None joins the one
            known here or starts one.
        choice: The setting that selects Ray, such as "collector=ray", for messages.

    Raises:
        InputError: Ray isn't installed, or the cluster is out of reach.
    """
    ray = extra("ray", "ray", choice)
    if ray.is_initialized():
        return ray, False
    try:
        with _kept_sigterm():
            ray.init(
                address=address,
                include_dashboard=False,
                log_to_driver=False,
                logging_level="warning",
            )
    except (ConnectionError, ValueError) as error:
        group = choice.partition("=")[0].replace("/", ".")
        raise InputError(
            f"{group}.address={address} can't be reached; start a cluster with "
            "ray start --head, or set it to local for one on this machine"
        ) from error
    return ray, True


@contextlib.contextmanager
def _kept_sigterm() -> Iterator[None]:
    """Keep the handler of SIGTERM, which `ray.init` replaces by one that exits with status 15."""
    is_main = threading.current_thread() is threading.main_thread()
    before = signal.getsignal(signal.SIGTERM) if is_main else None
    try:
        yield
    finally:
        if before is not None:
            signal.signal(signal.SIGTERM, before)
