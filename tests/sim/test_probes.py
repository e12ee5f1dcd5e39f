"""What devices measure: where it is written, and the noise in it."""

import numpy as np
from hapticd.sim.probes import AHEAD, Probe, Probes


def test_devices_say_the_truth_of_now() -> None:
    truth, said = np.array([1.0, 2.0, 3.0]), np.zeros(5)
    probes = Probes([Probe(said[:3], truth), Probe(said[4:], truth[1:2])], np.random.default_rng(1))
    probes.read()
    assert said.tolist() == [1.0, 2.0, 3.0, 0.0, 2.0]
    truth *= 2.0
    assert said[0] == 1.0
    for _ in range(2 * AHEAD):
        probes.read()
    assert said.tolist() == [2.0, 4.0, 6.0, 0.0, 4.0]


def test_noise_is_that_of_the_generator_drawn_one_reading_after_the_other() -> None:
    truth, noise = np.array([1.0, -2.0, 0.5]), np.array([0.1, 0.0, 3.0, 0.2])
    first, plain, second = np.zeros(3), np.zeros(3), np.zeros(1)
    rows = [Probe(first, truth, noise[:3]), Probe(plain, truth), Probe(second, truth[:1], noise[3:])]
    probes, random = Probes(rows, np.random.default_rng(7)), np.random.default_rng(7)
    for k in range(2 * AHEAD + 3):
        truth[0] = k
        probes.read()
        white = random.standard_normal(4) * noise
        assert first.tolist() == (truth + white[:3]).tolist() and plain.tolist() == truth.tolist()
        assert second.tolist() == (truth[:1] + white[3:]).tolist()
    noise[:] = 0.0  # read where it is
    probes.read()
    assert first.tolist() == truth.tolist()
