"""Wrong inputs, kills at any moment, full disks, limits of memory."""
