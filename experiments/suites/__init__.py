"""The swarms on suites of others: bbob-biobj, IMOP, RE, MW, DAS-CMOP and LZ09."""
