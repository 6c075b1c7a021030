"""Processes beside workers: those that were ended from outside, too early, or by a fork."""

import os
import signal
import time

from pymoo_hdte.problems._simulator.children import LOST, Children, parcel
from pymoo_hdte.problems._simulator.workers import Workers


def test_a_process_that_was_ended_while_idle_loses_no_evaluation():
    workers = Workers(1)
    workers.start("first", os.getpid)
    _, idle = workers.next()
    os.kill(idle, signal.SIGKILL)
    time.sleep(0.1)
    workers.start("second", abs, -3)
    assert workers.next() == ("second", 3)
    workers.close()


def test_a_call_that_was_cancelled_before_it_began_starts_no_process():
    children = Children()
    cancelled = children.round
    children.end()
    assert children.call(parcel(time.sleep, 60.0), None, cancelled).kind == LOST
    assert children.call(parcel(abs, -3), None, children.round) == 3
    children.end()


def test_a_fork_leaves_the_processes_of_its_parent_alone():
    children = Children()
    idle = children.call(parcel(os.getpid), None)
    fork = os.fork()
    if not fork:
        children.end()
        own = children.call(parcel(os.getpid), 5.0)
        children.end()
        os._exit(own == idle)
    assert os.waitpid(fork, 0)[1] == 0
    assert children.call(parcel(os.getpid), None) == idle
    children.end()
