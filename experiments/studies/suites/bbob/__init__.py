"""Problems of bbob-biobj, and shares of their targets that were published."""
