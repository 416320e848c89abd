# SPDX-License-Identifier: MIT
"""A job array of a real Slurm renders a list of frames on two nodes, one of which is killed.

Two slurmd on this machine are the nodes. Skipped where Slurm and MUNGE are not installed, and for
all but root, whom slurmd needs."""
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile

import support
from test_jobs import moving

support.needs(support.FAKE)
VITRAIL = os.path.join(support.BIN, "vitrail")
support.needs(VITRAIL)

PROGRAMS = ("munged", "mungekey", "slurmctld", "slurmd", "sbatch", "squeue", "scontrol")
for program in PROGRAMS:
    if not shutil.which(program, path=os.environ["PATH"] + ":/usr/sbin"):
        print(f"skipped: {program} is not installed")
        sys.exit(77)
if os.geteuid() != 0:
    print("skipped: slurmd runs as root only")
    sys.exit(77)

FRAMES, CHUNKS = 40, 10
CONFIGURATION = """
ClusterName=vitrail
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={ports[0]}
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
ReturnToService=2
SlurmdParameters=config_overrides
SlurmctldTimeout=10
SlurmdTimeout=5
KillWait=1
SchedulerParameters=requeue_setup_env_fail,bf_interval=1,sched_min_interval=0
StateSaveLocation={folder}/ctld
SlurmdSpoolDir={folder}/slurmd.%n
SlurmdPidFile={folder}/slurmd.%n.pid
SlurmctldPidFile={folder}/slurmctld.pid
NodeName=n1 NodeHostname={host} NodeAddr=127.0.0.1 Port={ports[1]} CPUs=1 State=UNKNOWN
NodeName=n2 NodeHostname={host} NodeAddr=127.0.0.1 Port={ports[2]} CPUs=1 State=UNKNOWN
PartitionName=render Nodes=n[1-2] Default=YES MaxTime=INFINITE State=UP
"""


class Slurm:
    """A cluster of two nodes in a folder of its own. Leaves no process behind."""

    def __init__(self, folder):
        self.folder, self.processes = folder, {}
        self.path = os.path.join(folder, "slurm.conf")
        for name in ("ctld", "slurmd.n1", "slurmd.n2"):
            os.mkdir(os.path.join(folder, name))
        with open(self.path, "w", encoding="utf-8") as file:
            file.write(CONFIGURATION.format(folder=folder, host=socket.gethostname().split(".")[0],
                                            ports=support.free_ports(3)))
        self.environment = {**os.environ, "SLURM_CONF": self.path,
                            "PATH": os.environ["PATH"] + ":/usr/sbin"}
        if self.version() >= (23, 11): # before, no control groups are asked for unless configured
            with open(os.path.join(folder, "cgroup.conf"), "w", encoding="utf-8") as file:
                file.write("CgroupPlugin=disabled\n") # a container may have none
        key = os.path.join(folder, "munge.key")
        subprocess.run(["mungekey", "--create", "--keyfile", key], env=self.environment,
                       check=True)
        self.start("munged", "--foreground", "--force", "--key-file", key, "--socket",
                   os.path.join(folder, "munge.socket"), "--pid-file",
                   os.path.join(folder, "munged.pid"), "--seed-file",
                   os.path.join(folder, "munge.seed"), "--log-file",
                   os.path.join(folder, "munged.log"))
        support.wait_until(lambda: os.path.exists(os.path.join(folder, "munge.socket")), "munge")
        self.start("slurmctld", "-D", "-i")
        self.start_node("n1")
        self.start_node("n2")
        support.wait_until(lambda: self.run("sinfo", "-h", "-o", "%T %D").split() == ["idle", "2"],
                           "both nodes are idle", 60)

    def version(self):
        return tuple(int(part) for part in self.run("slurmd", "-V").split()[1].split(".")[:2])

    def start(self, *command, name=None):
        with open(os.path.join(self.folder, f"{name or command[0]}.out"), "wb") as log:
            self.processes[name or command[0]] = subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=log, stderr=subprocess.STDOUT,
                env=self.environment, start_new_session=True)

    def start_node(self, node):
        self.start("slurmd", "-D", "-N", node, name=node)

    def run(self, *command):
        done = subprocess.run(command, env=self.environment, capture_output=True, text=True,
                              timeout=60, check=False)
        return done.stdout.strip()

    @staticmethod
    def tasks_of(node):
        """The processes of the node's tasks, and those of Slurm that watch them."""
        tasks, steps = [], []
        for entry in filter(str.isdigit, os.listdir("/proc")):
            try:
                with open(f"/proc/{entry}/environ", "rb") as file:
                    if f"SLURMD_NODENAME={node}\0".encode() not in file.read():
                        continue
                with open(f"/proc/{entry}/stat", encoding="utf-8") as file:
                    parent = file.read().rpartition(")")[2].split()[1]
                with open(f"/proc/{parent}/comm", encoding="utf-8") as file:
                    if file.read().startswith("slurmstepd"):
                        steps.append(parent)
            except OSError:
                continue
            tasks.append(entry)
        return tasks, steps

    def kill_node(self, node):
        """All at once, as where the power goes: the daemon, then what watches the node's tasks,
        so that nothing reports their end, then the tasks."""
        process = self.processes.pop(node)
        process.kill()
        process.wait()
        tasks, steps = self.tasks_of(node)
        for entry in steps + tasks:
            try:
                os.kill(int(entry), signal.SIGKILL)
            except ProcessLookupError:
                pass

    def stop(self):
        for process in self.processes.values():
            process.terminate()
        for process in self.processes.values():
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


class FarmSlurm(support.ServiceTest):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="vitrail-slurm-")
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        self.cluster = Slurm(folder.name)
        self.addCleanup(self.cluster.stop)

    def submit(self, scene):
        self.out = os.path.join(self.folder, "frames")
        os.makedirs(self.out, exist_ok=True)
        job = self.cluster.run(
            VITRAIL, "farm", "submit", scene, "-o", os.path.join(self.out, "f.%03d.png"),
            "--frames", f"1-{FRAMES}", "--slurm", "--chunks", str(CHUNKS), "--size", "32x16",
            "--camera", "fit:front", "--frame-rate", "1",
            "--server", f"http://127.0.0.1:{self.daemon.port}",
            "--sbatch", f"--output={self.folder}/task-%a-.log", "--job-name", "it's a test")
        self.assertTrue(job.isdigit(), job)
        return job

    def images(self):
        return sorted(name for name in os.listdir(self.out) if name.endswith(".png"))

    def test_a_node_that_is_killed_loses_no_frame(self):
        scene = os.path.join(self.folder, "scene.glb")
        with open(scene, "wb") as file:
            file.write(moving("fake:slow=120"))
        job = self.submit(scene)
        support.wait_until(lambda: len(self.images()) >= 6 and self.cluster.tasks_of("n2")[1],
                           "a task is under way", 120)
        self.cluster.kill_node("n2")
        self.cluster.run("scontrol", "update", "NodeName=n2", "State=DOWN", "Reason=killed")
        support.wait_until(lambda: len(self.images()) >= 16, "the other node goes on", 120)
        self.cluster.start_node("n2")
        self.cluster.run("scontrol", "update", "NodeName=n2", "State=RESUME")
        nodes = set()
        def release():
            """Slurm holds what it requeues for two minutes; an administrator may not."""
            self.cluster.run("scontrol", "update", f"JobId={job}", "StartTime=now")
            nodes.update(self.cluster.run("squeue", "-h", "-t", "R", "-o", "%N").split())
            return not self.cluster.run("squeue", "-h")
        support.wait_until(release, "the array has ended", 180)
        self.assertEqual([f"f.{n:03}.png" for n in range(1, FRAMES + 1)], self.images(),
                         self.cluster.run("sinfo"))
        logs = [name for name in os.listdir(self.folder) if name.startswith("task-")]
        self.assertEqual({str(n) for n in range(CHUNKS)}, {name.split("-")[1] for name in logs})
        self.assertEqual({"n1", "n2"}, nodes)
        posted = self.daemon.push(moving("fake:slow=120"))
        single = self.daemon.render(posted, format="png", animation={"time_s": 17},
                                    camera={"fit": "front"}, exposure_ev="auto")
        with open(os.path.join(self.out, "f.017.png"), "rb") as file:
            self.assertEqual(single.body, file.read())
        os.unlink(os.path.join(self.out, "f.011.png"))
        rendered = self.daemon.stats()["renders"]["rendered"]
        again = self.submit(scene)
        support.wait_until(lambda: not self.cluster.run("squeue", "-h", "-j", again),
                           "it is made again", 120)
        self.assertEqual(FRAMES, len(self.images()))
        self.assertEqual(rendered + 1, self.daemon.stats()["renders"]["rendered"])


if __name__ == "__main__":
    support.run_tests()
