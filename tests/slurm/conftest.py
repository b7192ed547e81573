"""A SLURM of one node, without accounting and on loopback alone, started and stopped by hand."""

import os
import shutil
import signal
import socket
import subprocess
import time
from importlib.util import find_spec
from pathlib import Path

import pytest

NODE_CPUS, NODE_MEMORY = 2, 16_000
"""What the node says it has [1, MB], be it true or not."""

CONFIGURATION = """
ClusterName=local
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={ports[0]}
SlurmdPort={ports[1]}
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
CredType=cred/munge
CommunicationParameters=NoCtldInAddrAny,NoInAddrAny
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
JobCompType=jobcomp/none
MpiDefault=none
SwitchType=switch/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core_Memory
SchedulerType=sched/backfill
SchedulerParameters=sched_interval=2,bf_interval=5,batch_sched_delay=1
SlurmdParameters=config_overrides
ReturnToService=2
MinJobAge=3600
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
NodeName={host} NodeAddr=127.0.0.1 CPUs={cpus} RealMemory={memory}
PartitionName=main Nodes={host} Default=YES MaxTime=INFINITE State=UP
"""


def pytest_collection_modifyitems(items):
    """Mark all tests of this folder; skip them, with the reason, where they cannot run."""
    missing = [name for name in ("munged", "slurmctld", "slurmd") if shutil.which(name) is None]
    reason = ""
    if find_spec("snakemake_executor_plugin_slurm") is None:
        reason = "no snakemake-executor-plugin-slurm here: pip install -r requirements-slurm.txt"
    elif missing:
        reason = f"no {', '.join(missing)} here: apt-get install slurm-wlm munge"
    elif os.geteuid() != 0:
        reason = "only root can start the daemons of SLURM"
    for item in items:
        if Path(__file__).parent in item.path.parents:
            item.add_marker(pytest.mark.slurm)
            if reason:
                item.add_marker(pytest.mark.skip(reason))


class Cluster:
    """The daemons of a cluster, all that they write in one folder."""

    def __init__(self, folder: Path):
        self.folder, self.daemons = folder, []
        for name in ("state", "spool", "bin"):
            (folder / name).mkdir()
        key = folder / "munge.key"
        key.write_bytes(os.urandom(1024))
        key.chmod(0o400)
        self.configuration = folder / "slurm.conf"
        self.configuration.write_text(
            CONFIGURATION.format(
                host=socket.gethostname().split(".")[0],
                ports=free_ports(2),
                folder=folder,
                cpus=NODE_CPUS,
                memory=NODE_MEMORY,
            )
        )
        # Inside a job Snakemake drops the variables of SLURM, and SLURM_CONF with them.
        step = folder / "bin" / "srun"
        step.write_text(
            f'#!/bin/sh\nSLURM_CONF={self.configuration} exec {shutil.which("srun")} "$@"\n'
        )
        step.chmod(0o755)
        self.environment = os.environ | {
            "SLURM_CONF": str(self.configuration),
            "PATH": f"{folder}/bin:{os.environ['PATH']}",
        }

    def start(self) -> None:
        """Start the daemons, and wait until the node takes jobs."""
        socket_file = self.folder / "munge.socket"
        self._daemon(
            *("munged", "--foreground", "--force", f"--key-file={self.folder / 'munge.key'}"),
            *(f"--socket={socket_file}", f"--pid-file={self.folder / 'munge.pid'}"),
            *(f"--seed-file={self.folder / 'munge.seed'}", "--num-threads=2"),
        )
        wait_for(socket_file.exists, 10, "munged has no socket")
        self._daemon("slurmctld", "-D", "-c", "-f", str(self.configuration))
        self._daemon("slurmd", "-D", "-f", str(self.configuration))
        wait_for(lambda: "idle" in self.ask("sinfo", "-h", "-o", "%T"), 60, "the node is not idle")

    def ask(self, *command: str) -> str:
        """What a command of SLURM answers."""
        done = subprocess.run(command, env=self.environment, capture_output=True, text=True)
        return done.stdout

    def stop(self) -> None:
        """Cancel what runs, and end the daemons, the last one first."""
        self.ask("scancel", "--me")
        for daemon in reversed(self.daemons):
            daemon.send_signal(signal.SIGTERM)
            try:
                daemon.wait(20)
            except subprocess.TimeoutExpired:
                daemon.kill()

    def _daemon(self, *command: str) -> None:
        with open(self.folder / f"{command[0]}.out", "w") as log:
            daemon = subprocess.Popen(
                command,
                env=self.environment,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                start_new_session=True,
            )
        self.daemons.append(daemon)


def free_ports(number: int) -> list[int]:
    """Ports of the loopback interface that nobody listens on."""
    sockets = [socket.create_server(("127.0.0.1", 0)) for _ in range(number)]
    ports = [found.getsockname()[1] for found in sockets]
    for found in sockets:
        found.close()
    return ports


def wait_for(condition, seconds: float, what: str) -> None:
    """Return as soon as the condition holds. Raises TimeoutError with `what` after `seconds`."""
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            raise TimeoutError(what)
        time.sleep(0.5)


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    """A cluster that runs until the last test of the module is done."""
    found = Cluster(tmp_path_factory.mktemp("cluster"))
    try:
        found.start()
        yield found
    finally:
        found.stop()
