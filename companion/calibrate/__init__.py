"""Learns from recorded traffic how far ships stray, and says how well that holds on other ships."""
