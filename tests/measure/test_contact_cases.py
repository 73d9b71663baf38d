from collections import Counter

import numpy as np
import pytest

from forcelab.measure.contact_cases import contact_cases
from forcelab.simulation.solvers import Lsoda, integrate

BOTH = ("left jaw", "right jaw")
#: What must happen in each case, and how often at least.
HAPPENINGS = {
    "foam": {
        "body lifted": 1,
        "body set down": 1,
        **{f"{jaw}: contact made": 1 for jaw in BOTH},
        **{f"{jaw}: contact lost": 1 for jaw in BOTH},
    },
    "cartridge": {"body lifted": 1, "body set down": 1},
    "stick-slip": {f"{jaw}: slip {what}": 4 for jaw in BOTH for what in ("begins", "ends")},
    "snap": {"snap out": 1, "out of the socket": 1, "into the socket": 1, "snap in": 1},
}


@pytest.fixture(scope="module")
def cases():
    return {case.name: case.make() for case in contact_cases(1)}


@pytest.mark.parametrize("name", HAPPENINGS)
def test_every_case_has_the_events_that_make_it_hard(cases, name):
    problem = cases[name]
    solution = integrate(problem.system, problem.start, problem.times, Lsoda(0.1))
    happened = Counter(event.kind for event in solution.events[0])
    assert all(happened[kind] >= number for kind, number in HAPPENINGS[name].items()), happened
    forces = problem.forces(problem.times, solution.states)
    assert forces.shape == (len(problem.times), 6, 1)
    # The jaws press like fingers do: some newtons, and never pull.
    pressing = -forces[:, [2, 5]]
    assert 3 < pressing.max() < 20
    assert pressing.min() > -0.5


def test_the_cases_are_the_four_contacts_in_their_order(cases):
    assert list(cases) == list(HAPPENINGS)
    # From foam to cartridge, stiffness spans more than two decades.
    stiffness = {name: p.system.scenes[0].body.stiffness for name, p in cases.items()}
    assert stiffness["cartridge"] > 100 * stiffness["foam"]


def test_lanes_differ_and_are_the_same_each_time():
    for one, again in zip(contact_cases(3), contact_cases(3), strict=True):
        first, second = one.make(), again.make()
        assert first.system.lanes == 3
        assert first.simulated == pytest.approx(3.0)
        assert (first.start == second.start).all()
        times = np.full(3, 0.4)
        moved = first.system.rates(times, first.start)
        assert (moved == second.system.rates(times, second.start)).all()
        assert len(np.unique(moved, axis=1).T) == 3
