# Stages: `page` builds the operator's page, `wheel` the wheel, `install` a virtual environment, `serve` is the small
# image that flies: Python and that environment, no compiler, no npm, no pip cache, no rights. `train` adds torch.
#   docker build --target serve -t uav-crowdsensing .
# How to run it: compose.demo.yaml, compose.drones.yaml, compose.postgres.yaml, compose.policy.yaml.
FROM node:22-bookworm-slim AS page
WORKDIR /src/gcs/dashboard
COPY gcs/dashboard/package.json gcs/dashboard/package-lock.json gcs/dashboard/.npmrc ./
RUN npm ci --no-audit --no-fund
COPY gcs/dashboard/ ./
RUN npm run build

FROM python:3.11-slim-bookworm AS wheel
WORKDIR /src
COPY pyproject.toml README.md LICENSE ./
COPY gcs gcs
COPY policy policy
COPY sitl_mock sitl_mock
COPY missions missions
COPY --from=page /src/gcs/dashboard/dist gcs/dashboard/dist
RUN pip wheel --no-cache-dir --no-deps --wheel-dir /wheels .

FROM python:3.11-slim-bookworm AS install
COPY --from=wheel /wheels /wheels
RUN python -m venv /opt/ucs && /opt/ucs/bin/pip install --no-cache-dir "$(ls /wheels/*.whl)[postgres]"

FROM python:3.11-slim-bookworm AS serve
RUN useradd --create-home --uid 10001 ucs && mkdir /data && chown ucs:ucs /data
COPY --from=install /opt/ucs /opt/ucs
ENV PATH=/opt/ucs/bin:$PATH PYTHONUNBUFFERED=1 NUMBA_CACHE_DIR=/data/.numba
USER 10001
WORKDIR /data
VOLUME /data
EXPOSE 8080
HEALTHCHECK --interval=10s --timeout=3s --start-period=90s \
    CMD ["python", "-c", "import urllib.request as r; r.urlopen('http://127.0.0.1:8080/healthz', timeout=2)"]
# Outside loopback the server refuses to start without keys: make the first one with `gcs keys add`.
ENTRYPOINT ["gcs"]
CMD ["serve", "--host", "0.0.0.0", "--port", "8080"]

FROM install AS train-install
RUN /opt/ucs/bin/pip install --no-cache-dir "$(ls /wheels/*.whl)[train]"

FROM serve AS train
COPY --from=train-install /opt/ucs /opt/ucs
ENTRYPOINT ["policy"]
CMD ["--help"]
