"""The solver of many designs at once, in lanes of SIMD registers."""
