"""The virtual bench on which prototypes are drawn and measured, as Section 2 of the paper does."""
