"""Identified models as files of simulators."""
