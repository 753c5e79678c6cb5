"""What several public functions share: the names of arguments in errors, which model predicts, progress."""
