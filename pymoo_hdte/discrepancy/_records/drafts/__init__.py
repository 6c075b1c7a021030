"""Drafts of rig.toml and campaign.toml, guessed from the files of a folder."""
