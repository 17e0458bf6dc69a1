"""How long commands take, and what share has passed when a message comes: written by tools/step_shares.py.

By command, or by command and first message; means over the recordings that were given. Do not edit.
"""

from collections.abc import Mapping

USUAL_S: Mapping[str, float] = {
    "diagnose": 102.3,
    "diagnose: fitting each joint alone": 257.3,
    "diagnose: reading the recording rightly": 24.7,
    "identify": 5.4,
    "identify: reading the recording": 5.4,
    "model confusability": 3.4,
    "next": 4.5,
    "next: reading the verdict": 4.5,
    "payload": 14.1,
    "payload: reading the recording rightly": 14.1,
    "recording check": 7.3,
    "recording check: reading the recording": 7.3,
}
SHARES: Mapping[str, Mapping[str, float]] = {
    "diagnose: fitting each joint alone": {
        "fitting each joint alone": 0.004,
        "replaying the joints together": 0.010,
        "fitted joint # of #": 0.138,
        "replaying held-out runs": 0.337,
        "timing the commands of all joints": 0.354,
        "weighing the tool": 0.354,
    },
    "diagnose: reading the recording rightly": {
        "reading the recording rightly": 0.055,
        "filtering": 0.064,
        "fitting links and friction": 0.086,
        "looking for candidates": 0.089,
        "searching, round #": 0.304,
        "fitting nonlinear parameters": 0.318,
        "searching, last round": 0.416,
        "testing claims": 0.424,
        "weighing names": 0.615,
        "fitting the model that predicts": 0.711,
        "stating numbers": 0.772,
        "writing the report": 0.965,
    },
    "identify: reading the recording": {
        "reading the recording": 0.001,
        "choosing cut-off and components": 0.054,
        "asking how it is to be read": 0.122,
        "choosing the cut-off": 0.148,
        "fitting": 0.526,
        "drawing the page": 0.579,
    },
    "next: reading the verdict": {
        "reading the verdict": 0.079,
        "preparing the questions": 0.376,
        "weighing what the motion tells": 0.649,
    },
    "payload: reading the recording rightly": {
        "reading the recording rightly": 0.013,
        "filtering": 0.020,
        "fitting links and friction": 0.035,
        "looking for candidates": 0.039,
        "searching, round #": 0.299,
        "fitting nonlinear parameters": 0.368,
        "searching, last round": 0.529,
        "testing claims": 0.567,
    },
    "recording check: reading the recording": {
        "reading the recording": 0.129,
        "drawing the page": 0.198,
        "asking how it is to be read": 0.272,
    },
}
