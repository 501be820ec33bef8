"""The trajectory network: trained, folded into float64 weights, evaluated, its rounding bounded."""
