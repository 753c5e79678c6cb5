"""What the verbs of several groups share: options, output, tables, pictures and progress."""
