"""Vehicles and trains: bodies, connectors, speed over chainage."""
