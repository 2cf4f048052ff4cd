"""A client of schedules.py: what it asks at random, which answers are right, and what they acknowledge."""
import http.client
import json
import os
import random
import signal
import ssl
import time

import program

JSON = {"Content-Type": "application/json"}
WAITS = ({"Prefer": "wait=20"}, {"Prefer": "respond-async"}, {})
RUNS, SWEEPS = 24, 6  # scenes whose results are compared with those of a daemon without a scheduler
TIMEOUT = 60  # [s]
FAULTS = {500, 503, 507}  # answers to a failed allocation or file call


class Ended(Exception):
    """The daemon has ended, as it was to."""


def scene(number, **changes):
    made = program.scene("paper_free_sponge")
    made.update(duration=1, sample_rate=100, output={"channels": ["displacement"], "psd": None})
    made["dampers"][0]["clearance"] = 0.012 + 1e-7 * number
    made.update(changes)
    return made


def sweep(number):
    axis = {"pointer": "/dampers/0/clearance", "from": 0.01, "to": 0.02, "count": 4}
    return scene(number, output={"channels": [], "psd": None}, study={"kind": "sweep", "metrics": ["impacts"], "axes": [axis]})


def slow(number):
    """One that is likely to be met by a cancel."""
    return scene(number, duration=3, output={"channels": [], "psd": None}, accuracy={"solver": "rk4", "step": 1e-5})


class References:
    """The scenes that are submitted again and again, their results and the bytes of these."""

    def __init__(self, options):
        self.scenes = []
        with program.daemon(*options) as daemon:
            for body in [*map(scene, range(RUNS)), *map(sweep, range(SWEEPS))]:
                result = program.finished(daemon, body)["result"]
                path = f"/v1/results/{result}/" + ("table.csv" if "study" in body else "series.npy")
                reply = daemon.get(path)
                assert reply.status == 200, reply
                self.scenes.append((body, result, path, reply.body))

    def draw(self, chance):
        """Those of one schedule: two runs and a sweep."""
        return [*chance.sample(self.scenes[:RUNS], 2), chance.choice(self.scenes[RUNS:])]


class Job:
    """A job that was acknowledged."""

    def __init__(self, name, result):
        self.id, self.result = name, result  # None if it is not known before
        self.is_settled = False
        self.cancels = []  # answers to cancels; None: there was no answer

    def __repr__(self):
        return f"{self.id}, cancels {self.cancels}"


class Actor:
    def __init__(self, campaign, daemon, index):
        self.campaign, self.daemon, self.index = campaign, daemon, index
        self.is_ending = False
        self.numbers = 0
        if daemon.url.startswith("https"):
            self.line = http.client.HTTPSConnection("127.0.0.1", daemon.port, context=ssl._create_unverified_context(), timeout=TIMEOUT)
        else:
            self.line = http.client.HTTPConnection("127.0.0.1", daemon.port, timeout=TIMEOUT)

    def ask(self, right, method, path, body=None, headers=None):
        """The answer, whose status has to be one of `right`."""
        try:
            self.line.request(method, path, body=json.dumps(body) if body is not None else None,
                              headers={**(JSON if body is not None else {}), **(headers or {})})
            reply = self.line.getresponse()
            text = reply.read()
            self.is_partial = reply.getheader("cache-control") == "no-store"
        except TimeoutError:
            raise
        except (http.client.HTTPException, OSError) as reason:
            self.line.close()
            if self.is_ending:
                raise Ended from reason
            if self.campaign.has_faults:
                return 0, b""
            raise
        allowed = right | (FAULTS if self.campaign.has_faults else set()) | ({503} if self.is_ending else set())
        assert reply.status in allowed, (method, path, reply.status, text[:600])
        return reply.status, text

    def act(self, seed, scenes):
        """Some actions at random."""
        self.chance, self.scenes, self.schedule = random.Random(f"{seed} {self.index}"), scenes, seed
        self.own = None
        for _ in range(self.chance.randrange(2, 5)):
            weights, actions = zip(*MIXES[self.campaign.mix])
            action = self.chance.choices(actions, weights)[0]
            status = action(self)
            self.campaign.answers[action.__name__, status] += 1

    def acknowledge(self, status, text, result):
        """The job of an answer to a submission."""
        if status not in (200, 202):
            return
        found = json.loads(text)
        self.own = self.campaign.jobs.setdefault(found["id"], Job(found["id"], result))
        self.own.is_settled = False

    def submit(self, body, result, headers):
        status, text = self.ask({200, 202}, "POST", "/v1/jobs", body, headers)
        self.acknowledge(status, text, result)
        return status

    def draw(self):
        """Mostly the same scene as the others."""
        return self.chance.choices(self.scenes, (4, 1, 2))[0]

    def run(self):
        body, result, _, _ = self.chance.choices(self.scenes[:2], (4, 1))[0]
        return self.submit(body, result, self.chance.choice(WAITS))

    def sweep(self):
        body, result, _, _ = self.scenes[2]
        return self.submit(body, result, self.chance.choice(WAITS))

    def keyed(self):
        """The same key by all clients: one job."""
        body, result, _, _ = self.scenes[0]
        key = {"Idempotency-Key": f'"{self.schedule}"'}
        first, second = (self.ask({200, 202}, "POST", "/v1/jobs", body, {**key, **self.chance.choice(WAITS)}) for _ in range(2))
        for status, text in (first, second):
            self.acknowledge(status, text, result)
        if first[0] in (200, 202) and second[0] in (200, 202):
            assert json.loads(first[1])["id"] == json.loads(second[1])["id"], (first, second)
        return second[0]

    def cancel(self):
        """Of a slow job of its own, or of the last one, which may share its run with others."""
        if self.own is None or self.chance.random() < 0.5:
            self.numbers += 1
            self.submit(slow(1000 * self.schedule + 100 * self.index + self.numbers), None, {"Prefer": "respond-async"})
            time.sleep(self.chance.random() * 0.01)
        job = self.own
        if job is None:
            return 0
        at = len(job.cancels)
        job.cancels.append(None)
        status, _ = self.ask({200, 409}, "DELETE", f"/v1/jobs/{job.id}")
        job.cancels[at] = status if status in (200, 409) else None
        return status

    def purge(self):
        """Removes a finished job; its result goes with the last job that has it."""
        body, result, _, _ = self.draw()
        self.submit(body, result, WAITS[0])
        job, self.own = self.own, None
        if job is None:
            return 0
        del self.campaign.jobs[job.id]
        status, _ = self.ask({204, 409}, "DELETE", f"/v1/jobs/{job.id}?purge=1")
        if status == 409 or (status in FAULTS and not self.is_ending):
            self.campaign.jobs[job.id] = job
        elif status == 204:
            self.campaign.purged.append(job.id)
        return status

    def delete(self):
        """409: it is being computed."""
        _, result, _, _ = self.draw()
        return self.ask({204, 404, 409}, "DELETE", f"/v1/results/{result}")[0]

    def read(self):
        """The bytes are those of a daemon without a scheduler, whether they are kept, in the cache or computed again."""
        _, _, path, expected = self.draw()
        status, text = self.ask({200, 404, 503}, "GET", path)
        assert status != 503 or self.is_ending or self.campaign.has_faults or b"while they were read; ask again" in text, text
        # A sweep that goes on has the rows so far.
        assert status != 200 or text == expected or (self.is_partial and set(text.splitlines()) <= set(expected.splitlines())), f"other bytes: {path}: {text[:300]} instead of {expected[:300]}"
        return status

    def watch(self):
        if self.own is None:
            return 0
        status, text = self.ask({200}, "GET", f"/v1/jobs/{self.own.id}/events")
        assert status != 200 or self.is_ending or b"event: finished" in text, text
        return status

    def look(self):
        return self.ask({200}, "GET", self.chance.choice(["/v1/jobs?limit=20", "/v1/cache", "/metrics", "/v1/materials", "/"]))[0]

    def rename(self):
        if self.own is None:
            return 0
        return self.ask({200}, "PATCH", f"/v1/jobs/{self.own.id}", {"title": f"schedule {self.schedule}"})[0]

    def revise(self):
        """Each revision that is acknowledged has a number of its own."""
        body = {"name": "Aluminium", "restitution": 0.6, "source": "again", "comment": f"schedule {self.schedule}, client {self.index}"}
        status, text = self.ask({201}, "POST", "/v1/materials/aluminium/revisions", body, {"If-Match": "*"})
        if status == 201:
            self.campaign.revisions.append(json.loads(text)["revision"])
        return status

    def reload(self):
        """SIGHUP."""
        if not self.is_ending:
            os.kill(self.daemon.process.pid, signal.SIGHUP)
        return 0

    def verify(self):
        """When all is quiet, each scene of the schedule has its result, with the right bytes."""
        for body, result, path, expected in self.scenes:
            status, text = self.ask({200, 202} if self.campaign.has_faults else {200}, "POST", "/v1/jobs", body, WAITS[0])
            self.acknowledge(status, text, result)
            if status != 200:  # it waits until its chunks are written again
                continue
            status, text = self.ask({200}, "GET", path)
            assert text == expected, f"other bytes at last: {path}: {text[:300]} instead of {expected[:300]}"

    def settle(self, job):
        """Waits for the end of a job, which must be the acknowledged one; a LookupError if it is not there."""
        for _ in range(15 if program.is_sanitized() else 4):
            status, text = self.ask({200, 404}, "GET", f"/v1/jobs/{job.id}?wait=20")
            if status == 404:
                raise LookupError(job.id)
            now = json.loads(text) if status == 200 else {"status": None}
            if now["status"] not in ("accepted", "running", None):
                break
        else:
            raise TimeoutError(f"is still {now}")
        dismissed, refused = job.cancels.count(200), job.cancels.count(409)
        assert dismissed <= 1, "cancelled twice"
        ends = {"dismissed"} if dismissed else {"successful"}
        if None in job.cancels and not refused:
            ends.add("dismissed")
        if self.campaign.has_faults and now["status"] == "failed":
            assert now["problem"]["status"] in FAULTS, now
            return
        assert now["status"] in ends, f"is {now['status']}, not {ends}: {now['problem']}"
        assert None in (job.result, now["result"]) or now["result"] == job.result, f"has the result {now['result']}, not {job.result}"


MIXES = {"all": [(6, Actor.run), (3, Actor.sweep), (2, Actor.keyed), (5, Actor.cancel), (3, Actor.delete), (2, Actor.purge), (5, Actor.read), (2, Actor.watch),
           (2, Actor.look), (1, Actor.rename), (1, Actor.revise), (1, Actor.reload)],
         # Tables of sweeps that are deleted while they are read.
         "tables": [(2, Actor.sweep), (1, Actor.delete), (3, Actor.read)]}
