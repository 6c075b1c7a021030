"""The swarms on suites of others: bbob-biobj, ZCAT, IMOP, RE, MW, DAS-CMOP and LZ09."""
