"""Result files: layout, writer and reader, journal, checkpoints, export."""
