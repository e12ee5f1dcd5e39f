import numpy as np
from hapticd.runtime.configuration import config
from hapticd.runtime.core.modes import Mode
from hapticd.testing.bench import Bench


def test_the_jacobian_is_the_derivative_of_the_handle():
    linkage = Bench(config.load("pantograph")).cycle.machine._linkage
    q, step = np.array([2.1, 0.9]), 1e-6
    columns = [(linkage.at(q + step * e)[0] - linkage.at(q - step * e)[0]) / (2 * step) for e in np.eye(2)]
    assert np.allclose(linkage.at(q)[1].T, columns, atol=1e-8)


def test_the_handle_follows_the_puck_into_the_wall_and_no_further():
    bench = Bench(config.load("pantograph"))
    bench.until(Mode.ACTIVE, limit=5000)
    bench.run(1000)
    machine = bench.cycle.machine
    assert 0.0 < machine.puck.depth < 0.01 and np.allclose(machine.puck.position, machine._handle, atol=5e-3)
