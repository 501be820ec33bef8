"""What is proved: certificates, that no plan exists, the regions of a network."""
