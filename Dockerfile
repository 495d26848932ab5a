# The whole application: one image for the server and for its workers (docker-compose.yml says which is which).

# --- build: packages from the lock with its hashes, and the pages -----------------------------------------------------
FROM python:3.13-slim-bookworm AS build

WORKDIR /app
COPY requirements-uv.txt requirements.txt ./
RUN python -m venv .venv \
 && .venv/bin/python -m pip install --no-cache-dir --disable-pip-version-check --require-hashes -r requirements-uv.txt \
 && .venv/bin/uv pip install --no-cache --python .venv/bin/python --require-hashes -r requirements.txt

COPY web web
RUN .venv/bin/python web/build.py && rm -rf web/node_modules

COPY pyproject.toml README.md LICENSE ./
COPY sim sim
COPY workers workers
COPY server server
RUN .venv/bin/uv pip install --no-cache --python .venv/bin/python --no-build-isolation --no-deps -e .

# --- run: nothing that only the build needs, and no rights ------------------------------------------------------------
FROM python:3.13-slim-bookworm

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
