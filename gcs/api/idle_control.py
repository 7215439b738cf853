"""A flight control without vehicles: for looking at records, and until drones are configured."""

from concurrent.futures import Future

from gcs.ports import FlightSnapshot, OperatorRequest, RequestOutcome


class IdleControl:
    """ports.FlightControl that has nothing to fly and says so."""

    def snapshot(self) -> FlightSnapshot:
        """Empty."""
        return FlightSnapshot(time_s=0.0, tick=0)

    def submit(self, request: OperatorRequest) -> Future[RequestOutcome]:
        """Refused, at once."""
        future: Future[RequestOutcome] = Future()
        future.set_result(RequestOutcome(False, "no drones are configured: name them under [drones] in the config"))
        return future

    def healthy(self) -> bool:
        """Nothing that could be late."""
        return True
