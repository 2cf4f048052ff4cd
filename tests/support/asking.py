"""Scenes that are quick or endless, and what a problem document must be. For the tests under contract/ that ask a daemon."""
import re

import program


def sponge(**changes):
    return {**program.scene("paper_free_sponge"), **changes}


def endless(number=0):
    """A scene that takes many seconds, another one for each number: few samples, millions of steps."""
    scene = program.scene("paper_free_sponge")
    scene.update(duration=2500 + number / 10, sample_rate=10, output={"channels": [], "psd": None, "reduction": False},
                 accuracy={"solver": "rk4", "step": 1e-5})
    return scene


def problem(reply, status, *pointers):
    """The problem document of a reply, which must have that status and just these faults."""
    assert reply.status == status, reply
    assert reply.headers["content-type"] == "application/problem+json", reply
    document = reply.json()
    assert document["status"] == status and document["title"] and document["detail"], document
    assert re.fullmatch(r"/problems/[a-z-]+", document["type"]), document
    if pointers:
        assert sorted(fault["pointer"] for fault in document["errors"]) == sorted(pointers), document
        assert all(fault["detail"] for fault in document["errors"]), document
    return document
