"""The plan of a campaign: before anything is measured, which tests tell which effects apart."""
