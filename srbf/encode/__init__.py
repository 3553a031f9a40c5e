"""What methods share while they encode a capture: model selection, light functions, quantization, UV seams, row blocks, dilation."""
