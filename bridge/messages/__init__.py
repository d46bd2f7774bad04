"""The telemetry contract, version 1: conversion of a vehicle's signals to MAVLink and back.

`readings`: the table of signals, for encoding and decoding; `compose`: converts samples and control ticks to
readings.
"""
