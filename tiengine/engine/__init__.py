"""The engine's inner workings."""
