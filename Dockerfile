# A vehicle on the CPU: docker build -t honeyguide . && docker run --rm honeyguide
FROM python:3.11-slim

ARG EXTRAS=""
WORKDIR /honeyguide
COPY . .
RUN pip install --no-cache-dir --constraint constraints.txt ".${EXTRAS}" \
    && useradd --create-home pilot && mkdir /flights && chown pilot /flights

USER pilot
WORKDIR /flights
# One flight compiles the kernels, so that those of the container begin at once.
RUN honeyguide fly --once --speed max --run-folder /tmp/first && rm -r /tmp/first

ENTRYPOINT ["honeyguide"]
CMD ["fly", "--once", "--speed", "max"]
