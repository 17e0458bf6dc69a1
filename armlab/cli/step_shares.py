"""How long commands take, and what share has passed when a message comes: written by tools/step_shares.py.

By command, or by command and first message; means over the recordings that were given. Do not edit.
"""

from collections.abc import Mapping

USUAL_S: Mapping[str, float] = {
    "diagnose": 61.0,
    "diagnose: fitting each joint alone": 125.7,
    "diagnose: reading the recording rightly": 28.6,
    "identify": 7.1,
    "identify: reading the recording": 7.1,
    "model confusability": 3.9,
    "next": 4.1,
    "next: reading the verdict": 4.1,
    "payload": 15.6,
    "payload: reading the recording rightly": 15.6,
    "predict": 0.9,
    "recording check": 8.8,
    "recording check: reading the recording": 8.8,
}
SHARES: Mapping[str, Mapping[str, float]] = {
    "diagnose: fitting each joint alone": {
        "fitting each joint alone": 0.003,
        "replaying the joints together": 0.010,
        "fitted joint # of #": 0.118,
        "replaying held-out runs": 0.620,
        "timing the commands of all joints": 0.650,
        "weighing the tool": 0.650,
    },
    "diagnose: reading the recording rightly": {
        "reading the recording rightly": 0.055,
        "filtering": 0.061,
        "fitting links and friction": 0.075,
        "looking for candidates": 0.076,
        "searching, round #": 0.257,
        "fitting nonlinear parameters": 0.281,
        "searching, last round": 0.413,
        "testing claims": 0.428,
        "weighing names": 0.644,
        "fitting the model that predicts": 0.748,
        "stating numbers": 0.811,
        "writing the report": 0.974,
    },
    "identify: reading the recording": {
        "reading the recording": 0.002,
        "choosing cut-off and components": 0.065,
        "asking how it is to be read": 0.091,
        "choosing the cut-off": 0.115,
        "fitting": 0.464,
        "drawing the page": 0.501,
    },
    "next: reading the verdict": {
        "reading the verdict": 0.070,
        "preparing the questions": 0.377,
        "weighing what the motion tells": 0.631,
    },
    "payload: reading the recording rightly": {
        "reading the recording rightly": 0.014,
        "filtering": 0.021,
        "fitting links and friction": 0.037,
        "looking for candidates": 0.040,
        "searching, round #": 0.301,
        "fitting nonlinear parameters": 0.373,
        "searching, last round": 0.538,
        "testing claims": 0.575,
    },
    "recording check: reading the recording": {
        "reading the recording": 0.118,
        "drawing the page": 0.202,
        "asking how it is to be read": 0.279,
    },
}
