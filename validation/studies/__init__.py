"""Experiments on studies: throughput of many short trains, kills, and separate hosts."""
