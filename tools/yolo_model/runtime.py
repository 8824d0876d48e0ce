"""ONNX Runtime through its C API, for machines that have the shared library but no Python package of it.

Covers what the tools need: open a model, run it on one float image, get float arrays back. The C API is a
table of functions whose order is fixed for good (onnxruntime_c_api.h, struct OrtApi: new ones are only
appended), so an entry is addressed by its place in that table.
"""

import ctypes
import ctypes.util

import numpy as np

API_VERSION = 16  # the oldest that is asked for; every later library serves it too

# Places in struct OrtApi.
GET_ERROR_MESSAGE = 2
CREATE_ENV = 3
CREATE_SESSION = 7
RUN = 9
CREATE_SESSION_OPTIONS = 10
SET_INTRA_OP_NUM_THREADS = 24
CREATE_TENSOR_WITH_DATA = 49
GET_TENSOR_MUTABLE_DATA = 51
GET_DIMENSIONS_COUNT = 61
GET_DIMENSIONS = 62
GET_TENSOR_TYPE_AND_SHAPE = 65
CREATE_CPU_MEMORY_INFO = 69
RELEASE_STATUS = 93
RELEASE_SESSION = 95
RELEASE_VALUE = 96
RELEASE_TENSOR_TYPE_AND_SHAPE = 99
RELEASE_SESSION_OPTIONS = 100

ELEMENT_FLOAT = 1
LOG_ERROR = 3
ALLOCATOR_DEVICE, MEMORY_DEFAULT = 0, 0

Handle = ctypes.c_void_p


class Library:
    """The loaded libonnxruntime."""

    def __init__(self, path=None):
        path = path or ctypes.util.find_library("onnxruntime")
        if not path:
            raise SystemExit("libonnxruntime.so was not found: name it with --runtime FILE")
        try:
            base = ctypes.CDLL(path).OrtGetApiBase
        except OSError as error:
            raise SystemExit(f"{path} cannot be loaded: {error}") from None
        base.restype = ctypes.POINTER(Handle)
        get_api = ctypes.CFUNCTYPE(ctypes.POINTER(Handle), ctypes.c_uint32)(base()[0])
        self._api = get_api(API_VERSION)
        if not self._api:
            raise SystemExit(f"{path} is older than ONNX Runtime 1.{API_VERSION}")
        self.env = self.create(CREATE_ENV, ctypes.c_int(LOG_ERROR), b"yolo_model")
        self.memory = self.create(
            CREATE_CPU_MEMORY_INFO, ctypes.c_int(ALLOCATOR_DEVICE), ctypes.c_int(MEMORY_DEFAULT)
        )

    def _function(self, place, result, args):
        # Integers that carry no ctypes type would be cut to 32 bits: callers wrap theirs.
        return ctypes.CFUNCTYPE(result, *[type(a) if not isinstance(a, bytes) else ctypes.c_char_p for a in args])(
            self._api[place]
        )

    def call(self, place, *args):
        """Calls an entry that returns a status; a failure becomes an exception with its message."""
        status = self._function(place, Handle, args)(*args)
        if status:
            status = Handle(status)
            message = self._function(GET_ERROR_MESSAGE, ctypes.c_char_p, (status,))(status).decode()
            self.release(RELEASE_STATUS, status)
            raise RuntimeError(message)

    def create(self, place, *args):
        """Calls an entry whose last argument receives a new object."""
        made = Handle()
        self.call(place, *args, ctypes.pointer(made))
        return made

    def release(self, place, handle):
        self._function(place, None, (handle,))(handle)


class Session:
    """One model, ready to run."""

    def __init__(self, library, model, inputs, outputs, threads=1):
        """`model` is a file's path; `inputs` and `outputs` are names."""
        self._library = library
        self._inputs = (ctypes.c_char_p * len(inputs))(*[n.encode() for n in inputs])
        self._outputs = (ctypes.c_char_p * len(outputs))(*[n.encode() for n in outputs])
        options = library.create(CREATE_SESSION_OPTIONS)
        library.call(SET_INTRA_OP_NUM_THREADS, options, ctypes.c_int(threads))
        self._session = library.create(CREATE_SESSION, library.env, str(model).encode(), options)
        library.release(RELEASE_SESSION_OPTIONS, options)

    def close(self):
        self._library.release(RELEASE_SESSION, self._session)

    def run(self, *arrays):
        """The outputs for float32 arrays, one per input."""
        arrays = [np.ascontiguousarray(a, np.float32) for a in arrays]
        given = (Handle * len(arrays))(*[self._tensor(a).value for a in arrays])
        made = (Handle * len(self._outputs))()
        self._library.call(
            RUN, self._session, Handle(), self._inputs, given, ctypes.c_size_t(len(given)),
            self._outputs, ctypes.c_size_t(len(made)), made,
        )  # fmt: skip
        results = [self._array(Handle(value)) for value in made]
        for value in [*given, *made]:
            self._library.release(RELEASE_VALUE, Handle(value))
        return results

    def _tensor(self, array):
        shape = (ctypes.c_int64 * array.ndim)(*array.shape)
        return self._library.create(
            CREATE_TENSOR_WITH_DATA, self._library.memory, Handle(array.ctypes.data), ctypes.c_size_t(array.nbytes),
            shape, ctypes.c_size_t(array.ndim), ctypes.c_int(ELEMENT_FLOAT),
        )  # fmt: skip

    def _array(self, value):
        info = self._library.create(GET_TENSOR_TYPE_AND_SHAPE, value)
        rank = ctypes.c_size_t()
        self._library.call(GET_DIMENSIONS_COUNT, info, ctypes.pointer(rank))
        shape = (ctypes.c_int64 * rank.value)()
        self._library.call(GET_DIMENSIONS, info, shape, rank)
        self._library.release(RELEASE_TENSOR_TYPE_AND_SHAPE, info)
        data = self._library.create(GET_TENSOR_MUTABLE_DATA, value)
        count = int(np.prod(shape))
        return np.ctypeslib.as_array(ctypes.cast(data, ctypes.POINTER(ctypes.c_float)), (count,)).reshape(shape).copy()
