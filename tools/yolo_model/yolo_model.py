#!/usr/bin/env python3
"""placeholder"""
import argparse
import onnx
import graph
from resize import resize
import sys
def size(t):
    w,h=t.split('x'); return int(w),int(h)
m=graph.load(sys.argv[1]); resize(m,size(sys.argv[2])); onnx.save(m,sys.argv[3])
