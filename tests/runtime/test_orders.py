"""What may be typed: keys mean what the screen says, lines are whole words, and nothing is guessed."""

import msgspec
import pytest
from hapticd.runtime.configuration.config import load
from hapticd.runtime.core.modes import MOST_TWINS, Command, Mode, exchange, together, twin_number
from hapticd.runtime.core.sections import Config
from hapticd.runtime.live.orders import Ear, Order, Request, key_line, legend, possible, remark, viewed
from hapticd.sim.person import Deed

from .conftest import loaded

REAL = ('kind = "simulated"', 'kind = "socketcan"\ninterface = "can0"')
PUNCTUAL = ('on_overrun = "record"', 'on_overrun = "stop"')
COMMANDED = ('by = "dead-man"', 'by = "command"')


def simulated() -> Config:
    return loaded().config


def real() -> Config:
    return loaded(REAL, PUNCTUAL, COMMANDED).config


def meanings(ear: Ear, data: bytes) -> list[object]:
    return [order.means for order in ear.hear(data).orders]


@pytest.mark.parametrize("single_keys", [True, False])
def test_every_order_is_heard_as_it_is_written_on_the_screen(single_keys: bool) -> None:
    for config in (simulated(), real()):
        orders = possible(config)
        ear = Ear(orders, single_keys)
        text = legend(orders, single_keys)
        for order in orders:
            for typed in order.keys if single_keys else (f"{order.word}\n",):
                assert meanings(ear, typed.encode()) == [order.means]
            shown = order.label if single_keys else order.word
            assert shown.split()[0] in text.replace("arrows", "arrow")


@pytest.mark.parametrize(
    "word", ["abort", "arming", "s", "a", "r", "q", "sto", "stopp", "halt", "stop reset"]
)
def test_a_word_that_is_no_order_does_nothing_and_is_answered(word: str) -> None:
    ear = Ear(possible(real()), single_keys=False)
    heard = ear.hear(f"{word}\n".encode())
    assert heard.orders == [] and heard.unknown == [word]
    answer = ear.answer(heard.unknown)
    assert word in answer and "stop, quit, help, reset, arm" in answer


def test_no_word_arms_a_machine_by_its_letters() -> None:
    ear = Ear(possible(real()), single_keys=True)
    letters = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ \n"
    assert Command.ARM not in meanings(ear, letters.encode())
    assert meanings(ear, b"+") == [Command.ARM]


def test_a_real_machine_has_no_simulated_person() -> None:
    orders = possible(real())
    assert not any(isinstance(order.means, Deed) for order in orders)
    for single_keys in (True, False):
        assert "push" not in legend(orders, single_keys) and "simulated" not in legend(orders, single_keys)
    assert "push" not in " ".join(key_line(orders))
    heard = Ear(orders, single_keys=False).hear(b"press\n")
    assert heard.orders == [] and heard.unknown == ["press"]


def test_arming_is_offered_where_the_configuration_asks_for_it() -> None:
    assert Command.ARM in [order.means for order in possible(loaded(COMMANDED).config)]
    assert Command.ARM not in [order.means for order in possible(simulated())]


def test_twins_are_numbers_on_a_terminal_and_words_in_a_pipe_and_a_view_has_them_where_nothing_is_real() -> (
    None
):
    several = load("giant with mass,door").config
    ear = Ear(possible(several), single_keys=True)
    assert meanings(ear, b"2") == [exchange(2)] and "2 door" in key_line(possible(several))
    assert meanings(Ear(possible(several), single_keys=False), b"twin mass\n") == [exchange(1)]
    assert {"twin mass", "twin door"} <= {order.word for order in viewed(several)}
    assert not any(order.word.startswith("twin") for order in possible(simulated()))
    there = msgspec.structs.replace(several, bus=real().bus)
    assert exchange(2) in [order.means for order in possible(there)]
    assert [order.means for order in viewed(there)] == [Command.STOP]
    assert remark(exchange(2), Mode.BRINGUP) and not remark(exchange(2), Mode.ACTIVE)


def test_of_two_twins_in_a_tick_the_last_counts_and_no_other_command_is_lost() -> None:
    assert together(exchange(3), exchange(4)) == exchange(4)
    assert together(Command.STOP | exchange(5), Command.RESET) == Command.STOP | Command.RESET | exchange(5)
    assert [twin_number(exchange(k) | Command.END) for k in range(1, MOST_TWINS + 1)] == [*range(1, 8)]
    assert twin_number(Command.STOP | Command.UNRECORDED) == 0 and int(exchange(MOST_TWINS)) < 256


def test_a_line_may_come_in_pieces_and_the_last_one_without_its_end() -> None:
    ear = Ear(possible(simulated()), single_keys=False)
    assert meanings(ear, b"st") == []
    assert meanings(ear, b"op\nqu") == [Command.STOP]
    assert meanings(ear, b"it") == []
    assert meanings(ear, b"") == [Request.QUIT]
    assert meanings(ear, b"\n \n") == []


def test_a_line_without_end_costs_no_memory() -> None:
    ear = Ear(possible(simulated()), single_keys=False)
    for _ in range(1000):
        ear.hear(b"stop" * 1000)
    assert len(ear._rest) < 1000
    heard = ear.hear(b"\nstop\n")
    assert [order.means for order in heard.orders] == [Command.STOP]
    assert len(ear.answer(heard.unknown)) < 300


def test_arrows_come_in_both_ways_of_terminals_and_their_relatives_are_no_orders() -> None:
    ear = Ear(possible(simulated()), single_keys=True)
    assert meanings(ear, b"\x1b[A\x1bOD") == [Deed.PUSH_FORWARD, Deed.PUSH_LEFT]
    for other in (b"\x1b[1;5D", b"\x1b[15~", b"\x1b", b"\x04", b"\xff\xfe", "ü".encode()):
        heard = ear.hear(other)
        assert heard.orders == [] and heard.unknown
        assert ear.answer(heard.unknown).isprintable()


def test_a_key_that_comes_in_pieces_is_one_key() -> None:
    for cut in (1, 2):
        ear = Ear(possible(simulated()), single_keys=True)
        sequence = b"\x1b[D"
        assert meanings(ear, b"r" + sequence[:cut]) == [Command.RESET]
        heard = ear.hear(sequence[cut:] + b"s")
        assert [order.means for order in heard.orders] == [Deed.PUSH_LEFT, Command.STOP]
        assert heard.unknown == []


def test_the_key_esc_waits_for_nothing_and_holds_no_other_key_up() -> None:
    ear = Ear(possible(simulated()), single_keys=True)
    assert ear.hear(b"\x1b").unknown == ["\x1b"]
    ear.hear(b"x\x1b")
    assert meanings(ear, b"s") == [Command.STOP]
    ear.hear(b"\x1b[" + b"1" * 100)  # no terminal sends this
    assert Command.STOP in meanings(ear, b"s" + b"s")


def test_space_stops() -> None:
    assert meanings(Ear(possible(real()), single_keys=True), b" ") == [Command.STOP]


@pytest.mark.parametrize("single_keys", [True, False])
def test_the_legend_fits_eighty_columns(single_keys: bool) -> None:
    for config in (simulated(), real(), loaded(COMMANDED).config):
        assert max(map(len, legend(possible(config), single_keys).splitlines())) < 80
    assert len("  ".join(key_line(possible(simulated())))) < 80


def test_no_key_means_two_things() -> None:
    for config in (simulated(), loaded(COMMANDED).config):
        keys = [key for order in possible(config) for key in order.keys]
        assert len(keys) == len(set(keys))


def test_a_command_that_changes_nothing_says_why() -> None:
    assert remark(Command.STOP, Mode.ACTIVE) == ""
    assert remark(Command.STOP, Mode.READY)
    assert remark(Command.ARM, Mode.STOPPED)
    assert remark(Command.ARM, Mode.READY) == ""
    assert remark(Command.RESET, Mode.BRINGUP)
    assert isinstance(possible(simulated())[0], Order)
