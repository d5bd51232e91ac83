"""Contact of wheel and rail: profiles, geometry tables, Hertz and Kalker."""
