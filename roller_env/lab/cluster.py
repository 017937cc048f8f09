"""Two Ray nodes on this machine: what a training does when they come and go, and what it costs.

Needs Ray, and so an environment of its own; see `roller_env.training.cluster`.
"""

from __future__ import annotations

import csv
import json
import os
import pickle
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, fields
from pathlib import Path
from statistics import median
from typing import Final

import psutil
import ray

from roller_env.training import rllib
from roller_env.training.checkpoint import load_checkpoint
from roller_env.training.config import TrainingConfig
from roller_env.training.files import RunFiles
from roller_env.training.logs import STEPS, read_progress
from roller_env.training.ppo import make_environments, new_model

_NODES: Final = ("127.0.0.2", "127.0.0.3")
"""Where the head and the other node are, both this machine's; Ray takes 127.0.0.1 for the address
that others reach it by."""

ADDRESS: Final = f"{_NODES[0]}:6399"

_TRAIN: Final = Path(__file__).resolve().parents[2] / "scripts" / "train.py"
_OBJECT_STORE_BYTES: Final = 2 * 10**8
_WAIT_S: Final = 240.0
"""Nothing of the trial takes longer, even on a machine that is busy."""

# Both nodes and the driver are this user's, and listen to this machine alone.
_ENVIRONMENT: Final = {
    **os.environ,
    "RAY_AUTH_MODE": "disabled",
    "RAY_USAGE_STATS_ENABLED": "0",
    "OMP_NUM_THREADS": "1",
}


class TrialError(RuntimeError):
    """A training on a cluster that did not do what it should."""


class Node:
    """A Ray node of one CPU, with all its processes."""

    def __init__(self, number: int) -> None:
        """Start the head, number 0, or another."""
        port = ADDRESS.rpartition(":")[2]
        head = ["--head", f"--port={port}", "--include-dashboard=false"]
        self._process = subprocess.Popen(
            [
                *(str(Path(sys.executable).with_name("ray")), "start", "--block"),
                *(head if number == 0 else [f"--address={ADDRESS}"]),
                *(f"--node-ip-address={_NODES[number]}", "--num-cpus=1"),
                # Any that are free: both nodes would else begin with the same.
                *("--min-worker-port=0", "--max-worker-port=0"),
                f"--object-store-memory={_OBJECT_STORE_BYTES}",
            ],
            env=_ENVIRONMENT,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )

    def kill(self) -> None:
        """End it as a power failure does: every process at once, none is asked."""
        begun = psutil.Process(self._process.pid)
        for process in [*begun.children(recursive=True), begun]:
            with suppress(psutil.NoSuchProcess):
                process.kill()
        self._process.wait()


@contextmanager
def two_nodes() -> Iterator[list[Node]]:
    """Start a head and another node; end whatever the list holds at last."""
    nodes: list[Node] = []
    try:
        for number in range(2):
            nodes.append(Node(number))
            wait(f"node {number}", lambda: alive_nodes() == len(nodes))
        yield nodes
    finally:
        for node in reversed(nodes):
            node.kill()


def alive_nodes() -> int:
    """Return how many nodes the cluster has; 0 if there is none."""
    say = (
        f"import ray; ray.init({ADDRESS!r}, logging_level=50);"
        "print(sum(node['Alive'] for node in ray.nodes()))"
    )
    said = subprocess.run(
        [sys.executable, "-c", say],
        env=_ENVIRONMENT,
        capture_output=True,
        text=True,
        check=False,
        timeout=_WAIT_S,
    )
    last = said.stdout.strip().rpartition("\n")[2]
    return int(last) if last.isdecimal() else 0


def wait(what: str, happens: Callable[[], bool]) -> float:
    """Wait for something; return the seconds that it took.

    Raises:
        TrialError: it does not happen.
    """
    begun = time.monotonic()
    while not happens():
        if time.monotonic() - begun > _WAIT_S:
            raise TrialError(f"{what}: not within {_WAIT_S:g} s")
        time.sleep(0.2)
    return time.monotonic() - begun


@dataclass(frozen=True, slots=True)
class Row:
    """A line of the results.

    Attributes:
        what: happened or was measured.
        value: of it.
        unit: of the value.
        kind: ``measured``, or ``model`` for what is reckoned and was never run.
    """

    what: str
    value: float
    unit: str
    kind: str = "measured"


class Training:
    """``roller train`` on the cluster, in a process of its own."""

    def __init__(self, runs: Path, level: str, settings: tuple[str, ...]) -> None:
        """Remember what is trained; nothing is there yet of an earlier trial."""
        self.files = RunFiles(runs / "cluster")
        shutil.rmtree(self.files.directory, ignore_errors=True)
        sets = [word for setting in settings for word in ("--set", setting)]
        self._command = [
            *(sys.executable, str(_TRAIN), level, "--cluster", ADDRESS),
            *("--runs", str(runs), "--name", "cluster", "--resume", *sets),
        ]
        self._log = runs / "cluster.log"
        runs.mkdir(parents=True, exist_ok=True)
        self._log.write_text("")

    def start(self) -> None:
        """Begin, or go on from the checkpoint."""
        with self._log.open("a") as log:
            self._process = subprocess.Popen(
                self._command, env=_ENVIRONMENT, stdout=log, stderr=log, start_new_session=True
            )

    def rows(self) -> list[dict[str, str]]:
        """Return the rows of its progress.

        Raises:
            TrialError: it has ended with an error.
        """
        if self._process.poll():
            raise TrialError(f"the training has failed:\n{self._log.read_text()[-2000:]}")
        return read_progress(self.files.progress)

    def steps(self) -> int:
        """Return how many steps its last row tells of."""
        rows = self.rows()
        return int(rows[-1][STEPS]) if rows else 0

    def last(self, name: str) -> int:
        """Return a number of its last row, 0 before the first."""
        rows = self.rows()
        return int(rows[-1][name]) if rows else 0

    def kill(self) -> None:
        """End it, if it has not ended, asking nobody."""
        self._process.kill()
        self._process.wait()

    def finish(self) -> None:
        """Wait for its end."""
        while self._process.poll() is None:
            self.rows()
            time.sleep(1.0)
        self.rows()


def trial(nodes: list[Node], training: Training, *, to_the_end: bool) -> list[Row]:
    """Let nodes and driver come and go under a training; return how long each took to mend.

    Args:
        nodes: the head and another; they are replaced.
        training: not begun.
        to_the_end: whether it has to master its level after all that.

    Raises:
        TrialError: it did not go on.
    """
    rows: list[Row] = []

    def after(what: str, happens: Callable[[], bool]) -> None:
        rows.append(Row(what, round(wait(what, happens), 1), "s"))
        print(f"{what}: {rows[-1].value} s", flush=True)

    def both() -> bool:
        return training.last("cluster/runners") == training.last("cluster/nodes") == 2

    training.start()
    after("from the start to an update by two runners on two nodes", both)
    kept = training.steps()
    after("three more updates", lambda: _updates(training, kept) >= 3)
    nodes.pop().kill()
    lost = training.steps()
    after(
        "from a node's death to three updates by the other",
        lambda: training.last("cluster/runners") == 1 and _updates(training, lost) >= 3,
    )
    nodes.append(Node(1))
    after("from a new node's start to an update by two runners on two nodes", both)
    wait("a checkpoint", training.files.checkpoint.exists)
    training.kill()
    checkpoint = load_checkpoint(training.files.checkpoint).progress.steps
    before = read_progress(training.files.progress)
    kept_rows = [row for row in before if int(row[STEPS]) <= checkpoint]
    training.start()
    after(
        "from a killed driver's resumption to an update past its checkpoint",
        # What was logged after the checkpoint is made again, with other times.
        lambda: any(row not in before for row in training.rows()),
    )
    if training.rows()[: len(kept_rows)] != kept_rows:
        raise TrialError("rows up to the checkpoint are not what they were")
    steps = [int(row[STEPS]) for row in training.rows()]
    if steps != sorted(set(steps)) or checkpoint not in steps:
        raise TrialError("rows are missing, or told twice")
    if to_the_end:
        training.finish()
        rows.append(Row("all this in one training: steps", training.steps(), ""))
        judged = json.loads(training.files.evaluation.read_text())["measures"]
        success = round(100.0 * judged["success rate"]["mean"], 1)
        rows.append(Row("its policy on MuJoCo's default: at the finish", success, "%"))
        rows.append(Row("its coins", round(judged["score (%)"]["mean"], 2), "%"))
    return rows


def _updates(training: Training, steps: int) -> int:
    return sum(int(row[STEPS]) > steps for row in training.rows())


@dataclass(frozen=True, slots=True)
class Costs:
    """What updates cost with a number of runners; medians over updates.

    Attributes:
        runners: how many.
        samples: of an update.
        batch: samples of a gradient step.
        epochs: passes over the samples.
        wall_s: of an update.
        sampling_s: wall seconds of which the driver waited for the runners.
        runner_cpu_s: CPU seconds of an update, all runners together.
        driver_cpu_s: CPU seconds of an update of the driver, which learns and merges.
        transfer_bytes: of an update's samples, as they are sent.
        transfer_cpu_s: CPU seconds to pack and unpack these.
    """

    runners: int
    samples: int
    batch: int
    epochs: int
    wall_s: float
    sampling_s: float
    runner_cpu_s: float
    driver_cpu_s: float
    transfer_bytes: int
    transfer_cpu_s: float


def measure(config: TrainingConfig, updates: int) -> Costs:
    """Measure updates on the cluster that this process is connected to.

    Args:
        config: of the training; ``cluster.runners`` says how many runners.
        updates: measured, after two that are not.
    """
    with tempfile.TemporaryDirectory() as directory:
        return _measure(config, RunFiles(Path(directory)), updates)


def _measure(config: TrainingConfig, files: RunFiles, updates: int) -> Costs:
    model = new_model(config, make_environments(config))
    driver = rllib.Driver(config, files, model, None)

    def cpu_of_runners() -> float:
        return float(sum(driver.on_runners(lambda _: time.process_time())))

    try:
        for _ in range(2):
            driver.update()
        walls, drivers, runners, samplings = [], [], [], []
        for _ in range(updates):
            runner_s, driver_s, wall_s = cpu_of_runners(), time.process_time(), time.monotonic()
            driver.update()
            walls.append(time.monotonic() - wall_s)
            drivers.append(time.process_time() - driver_s)
            runners.append(cpu_of_runners() - runner_s)
            # Once more, and nobody learns from it: how long the driver waits for samples.
            start = time.monotonic()
            episodes = driver.on_runners(lambda runner: runner.sample())
            samplings.append(time.monotonic() - start)
        start = time.process_time()
        packed = [pickle.dumps(one, protocol=5) for one in episodes]
        _ = [pickle.loads(one) for one in packed]
        transfer_s = time.process_time() - start
    finally:
        driver.stop()
    return Costs(
        runners=config.cluster.runners,
        samples=config.steps_per_update,
        batch=config.ppo.batch_size,
        epochs=config.ppo.epochs,
        wall_s=median(walls),
        sampling_s=median(samplings),
        runner_cpu_s=median(runners),
        driver_cpu_s=median(drivers),
        transfer_bytes=sum(map(len, packed)),
        transfer_cpu_s=transfer_s,
    )


def measured(costs: Costs) -> list[Row]:
    """Return the rows of what was measured."""
    name, n = f"{costs.runners:g} runner{'s' * (costs.runners > 1)}", costs.samples
    return [
        Row(f"{name}: speed", round(n / costs.wall_s), "steps/s of wall time"),
        Row(f"{name}: an update", round(costs.wall_s, 3), "s of wall time"),
        Row(f"{name}: of it waiting for samples", round(costs.sampling_s, 3), "s of wall time"),
        Row(f"{name}: a step", round(1e6 * costs.runner_cpu_s / n, 1), "us of a runner's CPU"),
        Row(f"{name}: learning", round(1e6 * costs.driver_cpu_s / n, 1), "us of CPU a step"),
        Row(f"{name}: sending", round(costs.transfer_bytes / n), "bytes a step"),
        Row(f"{name}: packing", round(1e6 * costs.transfer_cpu_s / n, 1), "us of CPU a step"),
    ]


@dataclass(frozen=True, slots=True)
class Model:
    """What an update would take on other machines. Nothing of it was ever run.

    An update is synchronous: first all runners play, each its part; then all samples pass through
    the network and the driver; then the learners learn, each its part of every batch. What learners
    tell each other is left out, and so is that some runner is always the last.

    Attributes:
        step_s: CPU seconds for a runner to play a step.
        pack_s: CPU seconds for the driver to take a step's sample up.
        sample_bytes: of a step's sample.
        gradient_s: CPU seconds of a gradient step, whatever its batch.
        pass_s: CPU seconds more for each sample of its batch.
        samples: of an update.
        batch: samples of a gradient step.
        epochs: passes over the samples.
    """

    step_s: float
    pack_s: float
    sample_bytes: float
    gradient_s: float
    pass_s: float
    samples: int
    batch: int
    epochs: int

    @staticmethod
    def of(small: Costs, large: Costs) -> Model:
        """Return the model of two measurements that differ in the batch alone."""
        steps = [costs.epochs * costs.samples / costs.batch for costs in (small, large)]
        gradient_s = (small.driver_cpu_s - large.driver_cpu_s) / (steps[0] - steps[1])
        passes = small.epochs * small.samples
        return Model(
            step_s=small.runner_cpu_s / small.samples,
            pack_s=small.transfer_cpu_s / small.samples,
            sample_bytes=small.transfer_bytes / small.samples,
            gradient_s=gradient_s,
            pass_s=(small.driver_cpu_s - steps[0] * gradient_s) / passes,
            samples=small.samples,
            batch=small.batch,
            epochs=small.epochs,
        )

    def parts(self) -> list[Row]:
        """Return what the model is made of."""
        return [
            Row("a gradient step, of any batch", round(1e3 * self.gradient_s, 2), "ms of CPU"),
            Row("and for each sample of it", round(1e6 * self.pass_s, 2), "us of CPU"),
        ]

    def speed(self, runners: int, learners: int, scale: int, bytes_per_s: float) -> Row:
        """Return the speed, in steps a second, on a core for each runner and learner.

        Args:
            runners: that play.
            learners: that learn; one: the driver.
            scale: times the environments and the batch of what was measured.
            bytes_per_s: of the driver's network.
        """
        samples, batch = scale * self.samples, scale * self.batch
        play_s = samples * self.step_s / runners
        send_s = samples * (self.pack_s + self.sample_bytes / bytes_per_s)
        gradient_steps = self.epochs * samples / batch
        learn_s = gradient_steps * (self.gradient_s + self.pass_s * batch / learners)
        what = f"{runners + learners} cores ({runners} runners, learning on {learners}), "
        what += "the recipe" if scale == 1 else f"{scale} times its environments and batch"
        return Row(what, round(samples / (play_s + send_s + learn_s)), "steps/s", "model")


def middle(rounds: list[Costs]) -> Costs:
    """Return the medians of several measurements of the same."""
    return Costs(**{f.name: median(getattr(one, f.name) for one in rounds) for f in fields(Costs)})


def write(rows: list[Row], file: Path) -> None:
    """Write the rows as CSV."""
    with file.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(["what", "value", "unit", "kind"])
        writer.writerows([row.what, row.value, row.unit, row.kind] for row in rows)


@contextmanager
def connected() -> Iterator[None]:
    """Make this process part of the cluster."""
    os.environ["RAY_AUTH_MODE"] = "disabled"
    ray.init(ADDRESS, logging_level="ERROR", log_to_driver=False)
    try:
        yield
    finally:
        ray.shutdown()


def shown(rows: list[Row]) -> str:
    """Return the rows as a Markdown table."""
    lines = ["| what | value | |", "|---|---:|---|"]
    lines += [f"| {row.what} | {row.value:,g} {row.unit} | {row.kind} |" for row in rows]
    return "\n".join(lines)
