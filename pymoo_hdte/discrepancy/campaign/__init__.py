"""A campaign: records of one rig in one session, and what is believed about it."""
