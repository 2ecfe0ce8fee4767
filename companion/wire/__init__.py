"""Bytes to messages and back; no I/O, no clock, never an exception for what came from outside."""
