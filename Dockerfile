# The whole application: one image for the server and for its workers (docker-compose.yml says which is which).

# Where everything comes from, for places that have mirrors of their own:
#   BASE_IMAGE     Python 3.11 or newer on glibc, with venv
#   PACKAGE_INDEX  of Python packages; NPM_REGISTRY of the pages'; without them those that pip, uv and npm know
#   LOCK           hash-pinned requirements, one of this folder's files
ARG BASE_IMAGE=python:3.13-slim-bookworm

# --- build: packages from the lock with its hashes, and the pages -----------------------------------------------------
FROM ${BASE_IMAGE} AS build

ARG BASE_IMAGE
ARG PACKAGE_INDEX=""
ARG NPM_REGISTRY=""
ARG LOCK=requirements.txt
WORKDIR /app
COPY requirements-uv.txt ${LOCK} ./
RUN echo "Built on $BASE_IMAGE, $(python3 -V), with the packages of $LOCK from ${PACKAGE_INDEX:-pip's own index}." \
 && if [ -n "$PACKAGE_INDEX" ]; then export PIP_INDEX_URL="$PACKAGE_INDEX" UV_DEFAULT_INDEX="$PACKAGE_INDEX"; fi \
 && python3 -m venv .venv \
 && .venv/bin/python -m pip install --no-cache-dir --disable-pip-version-check --require-hashes -r requirements-uv.txt \
 && .venv/bin/uv pip install --no-cache --python .venv/bin/python --require-hashes -r "$LOCK"

COPY web web
RUN if [ -n "$NPM_REGISTRY" ]; then export NPM_CONFIG_REGISTRY="$NPM_REGISTRY"; fi \
 && .venv/bin/python web/build.py && rm -rf web/node_modules

COPY pyproject.toml README.md LICENSE ./
COPY sim sim
COPY workers workers
COPY server server
RUN .venv/bin/uv pip install --no-cache --python .venv/bin/python --no-build-isolation --no-deps -e .

# --- run: nothing that only the build needs, and no rights ------------------------------------------------------------
FROM ${BASE_IMAGE}

RUN useradd --create-home --uid 10001 mapless \
 && install -d -o mapless -g mapless /data /home/mapless/.cache/numba
WORKDIR /app
COPY --from=build /app /app

ENV PATH=/app/.venv/bin:$PATH \
    PYTHONUNBUFFERED=1 \
    PYTHONDONTWRITEBYTECODE=1 \
    NUMBA_CACHE_DIR=/home/mapless/.cache/numba \
    MAPLESS_DATA_DIR=/data

# What `mapless version` and the pages show: docker build --build-arg COMMIT="$(git rev-parse --short HEAD)"
ARG COMMIT=""
RUN echo "$COMMIT" > /app/COMMIT

USER mapless
# A worker's first training should not wait for the compiler.
RUN python -m workers.precompile
VOLUME /data
EXPOSE 8400
ENTRYPOINT ["mapless"]
CMD ["serve"]
