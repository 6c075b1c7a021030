"""Model runs that a surrogate of a robust problem takes, beside chaospy's and OpenTURNS's."""
