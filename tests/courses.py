"""What the solver counted: the trajectories of the runs that follow."""

import pytest

from thsa_cosim.fmu.trajectory import Course, Trajectory


def noted_courses(monkeypatch: pytest.MonkeyPatch) -> list[Trajectory]:
    """A list that every run of an exported FMU with free steps adds its trajectory to."""
    courses: list[Trajectory] = []
    made = Course.__init__

    def noted(self: Course, *given: object) -> None:
        made(self, *given)  # type: ignore[arg-type]
        courses.append(self.struct)

    monkeypatch.setattr(Course, "__init__", noted)
    return courses
