"""Which effects the printed equations lack: a ladder of models fitted to published numbers."""
