/*
 * The module hapticd.hqp._qp: the QP solver as a function of Python. It reads numpy's arrays where they lie,
 * as a call by way of cffi, with a view of each, takes longer than a small QP.
 */
#include <Python.h>
#include <structmember.h>

#include <limits.h>
#include <stddef.h>

#define NPY_NO_DEPRECATED_API NPY_2_0_API_VERSION
#include <numpy/arrayobject.h>

#include "hqp_qp.h"

enum { P, Q, G, H, A, B, LB, UB, START, ARRAYS, ITERATIONS = ARRAYS, SECONDS, STATUS, ARGUMENTS };
enum { KEPT = 8 }; /* as many threads find their memory again */

/* What a solve works in: for QPs of up to n variables and so many rows. */
typedef struct memory {
    hqp_qp_solver *solver;
    int n, rows;
} memory;

/* Memory that nobody works in. Who looks at it has the interpreter's lock. */
static memory idle[KEPT];
static int idle_count;

static int larger(int a, int b) {
    return a > b ? a : b;
}

/* Where there is none for these sizes, no solver and an exception. */
static memory borrow(int n, int rows) {
    memory found = {NULL, 0, 0};
    if (idle_count) found = idle[--idle_count];
    if (n <= found.n && rows <= found.rows) return found;
    const memory grown = {NULL, larger(n, found.n), larger(rows, found.rows)};
    hqp_qp_destroy(found.solver);
    found = grown;
    found.solver = hqp_qp_create(found.n, found.rows);
    if (!found.solver) PyErr_SetString(PyExc_ValueError, "sizes are out of range");
    return found;
}

static void give_back(memory used) {
    if (used.solver && idle_count < KEPT) {
        idle[idle_count++] = used;
    } else {
        hqp_qp_destroy(used.solver);
    }
}

static int is_readable(PyObject *value) {
    if (!PyArray_CheckExact(value)) return 0;
    PyArrayObject *array = (PyArrayObject *)value;
    return PyArray_TYPE(array) == NPY_DOUBLE && PyArray_ISCARRAY_RO(array);
}

/* A contiguous array of doubles, or NULL with an exception. numpy takes long to see that there is nothing to
 * be done. */
static PyObject *readable(PyObject *value) {
    if (!is_readable(value)) {
        if (!PyArray_CheckExact(value)) return PyErr_Format(PyExc_TypeError, "look at it in Python");
        return PyArray_FROMANY(value, NPY_DOUBLE, 0, 0, NPY_ARRAY_CARRAY_RO);
    }
    Py_INCREF(value);
    return value;
}

/* Where there is None, there is none. Returns 0 with an exception. */
static int take_arrays(PyObject *const *values, PyArrayObject **arrays) {
    for (int i = 0; i < ARRAYS; i++) {
        if (values[i] == Py_None) continue;
        arrays[i] = (PyArrayObject *)readable(values[i]);
        if (!arrays[i]) return 0;
    }
    return 1;
}

/* Entries of a vector and rows of a matrix; 0 of what has no dimension, or where there is none. */
static npy_intp length_of(PyArrayObject *array) {
    return array && PyArray_NDIM(array) ? PyArray_DIM(array, 0) : 0;
}

static int is_vector(PyArrayObject *array, npy_intp length) {
    return PyArray_NDIM(array) == 1 && PyArray_DIM(array, 0) == length;
}

static int is_matrix(PyArrayObject *array, npy_intp rows, npy_intp columns) {
    return PyArray_NDIM(array) == 2 && PyArray_DIM(array, 0) == rows && PyArray_DIM(array, 1) == columns;
}

/* Rows and their bounds, as many, or neither. */
static int are_rows(PyArrayObject *rows, PyArrayObject *bounds, npy_intp n) {
    if (!rows || !bounds) return rows == bounds;
    return is_vector(bounds, length_of(bounds)) && is_matrix(rows, length_of(bounds), n);
}

static int fit_together(PyArrayObject *const *a) {
    if (!a[P] || !a[Q]) return 0;
    const npy_intp n = length_of(a[Q]), rows = length_of(a[B]) + length_of(a[H]);
    if (n < 1 || n > INT_MAX || rows > INT_MAX) return 0;
    if (!is_vector(a[Q], n) || !is_matrix(a[P], n, n)) return 0;
    if (!are_rows(a[A], a[B], n) || !are_rows(a[G], a[H], n)) return 0;
    for (int i = LB; i <= START; i++) {
        if (a[i] && !is_vector(a[i], n)) return 0;
    }
    return 1;
}

static const double *entries(PyArrayObject *array) {
    return array ? PyArray_DATA(array) : NULL;
}

/* Returns 0 with an exception. */
static int take_limits(PyObject *const *arguments, hqp_qp *qp) {
    const long iterations = PyLong_AsLong(arguments[ITERATIONS]);
    qp->time_limit = PyFloat_AsDouble(arguments[SECONDS]);
    if (PyErr_Occurred()) return 0;
    if (iterations < 0 || iterations > INT_MAX) {
        PyErr_SetString(PyExc_ValueError, "max_iterations is out of range");
        return 0;
    }
    qp->max_iterations = (int)iterations;
    return 1;
}

/* What solve gives back. Its fields are those of hapticd.hqp.qp_solution.QpSolution. */
typedef struct solution {
    PyObject_HEAD PyObject *x, *status, *conflict, *multipliers;
    double objective;
    int iterations, equalities, inequalities, ends;
    char found;
} solution;

static PyMemberDef fields[] = {{"x", T_OBJECT_EX, offsetof(solution, x), 0, NULL},
                               {"status", T_OBJECT_EX, offsetof(solution, status), 0, NULL},
                               {"found", T_BOOL, offsetof(solution, found), 0, NULL},
                               {"iterations", T_INT, offsetof(solution, iterations), 0, NULL},
                               {"objective", T_DOUBLE, offsetof(solution, objective), 0, NULL},
                               {"conflict", T_OBJECT_EX, offsetof(solution, conflict), 0, NULL},
                               {"_multipliers", T_OBJECT_EX, offsetof(solution, multipliers), 0, NULL},
                               {"_equalities", T_INT, offsetof(solution, equalities), 0, NULL},
                               {"_inequalities", T_INT, offsetof(solution, inequalities), 0, NULL},
                               {"_ends", T_INT, offsetof(solution, ends), READONLY, NULL},
                               {NULL, 0, 0, 0, NULL}};

static int visit_objects(PyObject *self, visitproc visit, void *arg) {
    solution *s = (solution *)self;
    Py_VISIT(Py_TYPE(self));
    Py_VISIT(s->x);
    Py_VISIT(s->status);
    Py_VISIT(s->conflict);
    Py_VISIT(s->multipliers);
    return 0;
}

static int clear_objects(PyObject *self) {
    solution *s = (solution *)self;
    Py_CLEAR(s->x);
    Py_CLEAR(s->status);
    Py_CLEAR(s->conflict);
    Py_CLEAR(s->multipliers);
    return 0;
}

static void free_solution(PyObject *self) {
    PyTypeObject *type = Py_TYPE(self);
    PyObject_GC_UnTrack(self);
    clear_objects(self);
    ((freefunc)PyType_GetSlot(type, Py_tp_free))(self);
    Py_DECREF(type);
}

/* A solution with room for the answer to a QP of this size. */
static solution *new_solution(PyObject *type, const hqp_qp *qp) {
    solution *s = (solution *)PyType_GenericAlloc((PyTypeObject *)type, 0);
    if (!s) return NULL;
    npy_intp n = qp->n, rows = (npy_intp)qp->equalities + qp->inequalities + n;
    s->x = PyArray_SimpleNew(1, &n, NPY_DOUBLE);
    s->multipliers = PyArray_SimpleNew(1, &rows, NPY_DOUBLE);
    s->conflict = PyList_New(0);
    s->equalities = qp->equalities;
    s->inequalities = qp->inequalities;
    if (s->x && s->multipliers && s->conflict) return s;
    Py_DECREF((PyObject *)s);
    return NULL;
}

/* Returns 0 with an exception. */
static int pose(PyArrayObject *const *a, hqp_qp *qp) {
    if (!fit_together(a)) {
        PyErr_SetString(PyExc_ValueError, "sizes do not fit");
        return 0;
    }
    *qp = (hqp_qp){.n = (int)length_of(a[Q]),
                   .equalities = (int)length_of(a[B]),
                   .inequalities = (int)length_of(a[H]),
                   .P = entries(a[P]),
                   .q = entries(a[Q]),
                   .A = entries(a[A]),
                   .b = entries(a[B]),
                   .G = entries(a[G]),
                   .h = entries(a[H]),
                   .lb = entries(a[LB]),
                   .ub = entries(a[UB]),
                   .start = entries(a[START])};
    return 1;
}

static PyObject *solve_arrays(PyObject *type, PyArrayObject *const *a, PyObject *const *arguments) {
    hqp_qp qp;
    if (!pose(a, &qp)) return NULL;
    if (!take_limits(arguments, &qp)) return NULL;
    solution *s = new_solution(type, &qp);
    if (!s) return NULL;
    const memory used = borrow(qp.n, qp.equalities + qp.inequalities);
    if (!used.solver) {
        Py_DECREF((PyObject *)s);
        return NULL;
    }
    hqp_qp_answer found = {.x = PyArray_DATA((PyArrayObject *)s->x),
                           .multipliers = PyArray_DATA((PyArrayObject *)s->multipliers)};
    PyThreadState *thread = PyEval_SaveThread();
    s->ends = hqp_qp_solve(used.solver, &qp, &found);
    PyEval_RestoreThread(thread);
    give_back(used);
    s->objective = found.objective;
    s->iterations = found.iterations;
    s->found = s->ends == HQP_QP_SOLVED;
    s->status = s->found ? arguments[STATUS] : Py_None;
    Py_INCREF(s->status);
    return (PyObject *)s;
}

static PyObject *solve(PyObject *type, PyObject *const *arguments, Py_ssize_t count) {
    if (count != ARGUMENTS) return PyErr_Format(PyExc_TypeError, "solve takes %d arguments", ARGUMENTS);
    PyArrayObject *arrays[ARRAYS] = {NULL};
    PyObject *answer = take_arrays(arguments, arrays) ? solve_arrays(type, arrays, arguments) : NULL;
    for (int i = 0; i < ARRAYS; i++) Py_XDECREF((PyObject *)arrays[i]);
    return answer;
}

static PyObject *judge_arrays(PyArrayObject *const *a, PyArrayObject *multipliers) {
    hqp_qp qp;
    if (!pose(a, &qp)) return NULL;
    const npy_intp rows = (npy_intp)qp.equalities + qp.inequalities + qp.n;
    if (!qp.start || !is_vector(multipliers, rows)) return PyErr_Format(PyExc_ValueError, "sizes do not fit");
    const memory used = borrow(qp.n, qp.equalities + qp.inequalities);
    if (!used.solver) return NULL;
    const int is_proven = hqp_qp_is_proven(used.solver, &qp, qp.start, entries(multipliers));
    give_back(used);
    return PyBool_FromLong(is_proven);
}

static PyObject *judge(PyObject *module, PyObject *const *arguments, Py_ssize_t count) {
    (void)module;
    if (count != ARRAYS + 1) return PyErr_Format(PyExc_TypeError, "is_proven takes %d arrays", ARRAYS + 1);
    PyArrayObject *arrays[ARRAYS] = {NULL};
    PyObject *answer = NULL, *multipliers = readable(arguments[ARRAYS]);
    if (multipliers && take_arrays(arguments, arrays))
        answer = judge_arrays(arrays, (PyArrayObject *)multipliers);
    for (int i = 0; i < ARRAYS; i++) Py_XDECREF((PyObject *)arrays[i]);
    Py_XDECREF(multipliers);
    return answer;
}

static PyMethodDef functions[] = {
    {"is_proven", (PyCFunction)(void (*)(void))judge, METH_FASTCALL,
     "Whether x, in the place of initvals, is optimal by the multipliers behind it: y, z, z_box."},
    {NULL, NULL, 0, NULL}};

static PyMethodDef methods[] = {{"solve", (PyCFunction)(void (*)(void))solve, METH_FASTCALL | METH_CLASS,
                                 "As solve_qp, with the status of what is solved as the last argument."},
                                {NULL, NULL, 0, NULL}};

static PyType_Slot slots[] = {{Py_tp_members, fields},
                              {Py_tp_methods, methods},
                              {Py_tp_traverse, (void *)visit_objects},
                              {Py_tp_clear, (void *)clear_objects},
                              {Py_tp_dealloc, (void *)free_solution},
                              {0, NULL}};

static PyType_Spec specification = {"hapticd.hqp._qp.Solution", sizeof(solution), 0,
                                    Py_TPFLAGS_DEFAULT | Py_TPFLAGS_BASETYPE | Py_TPFLAGS_HAVE_GC, slots};

static struct PyModuleDef definition = {PyModuleDef_HEAD_INIT, .m_name = "_qp", .m_size = -1,
                                        .m_methods = functions};

static int fill(PyObject *module) {
    static const struct {
        const char *name;
        hqp_qp_status value;
    } statuses[] = {{"INFEASIBLE", HQP_QP_INFEASIBLE},       {"UNBOUNDED", HQP_QP_UNBOUNDED},
                    {"ITERATION_CAP", HQP_QP_ITERATION_CAP}, {"TIME_LIMIT", HQP_QP_TIME_LIMIT},
                    {"NOT_PROVEN", HQP_QP_NOT_PROVEN},       {"NOT_CONVEX", HQP_QP_NOT_CONVEX},
                    {"NOT_SYMMETRIC", HQP_QP_NOT_SYMMETRIC}};
    for (size_t i = 0; i < sizeof statuses / sizeof *statuses; i++) {
        if (PyModule_AddIntConstant(module, statuses[i].name, statuses[i].value) < 0) return 0;
    }
    PyObject *type = PyType_FromSpec(&specification);
    const int is_added = type && PyModule_AddObjectRef(module, "Solution", type) == 0;
    Py_XDECREF(type);
    return is_added;
}

PyMODINIT_FUNC PyInit__qp(void) {
    if (PyArray_ImportNumPyAPI() < 0) return NULL;
    PyObject *module = PyModule_Create(&definition);
    if (module && !fill(module)) Py_CLEAR(module);
    return module;
}
