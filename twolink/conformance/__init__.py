"""The conformance kit: vectors, transports, judge and diagnosis for any engine in any language."""
