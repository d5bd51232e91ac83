"""Studies: a scenario, factors that vary, and thousands of trains from them, with the answers they give."""
